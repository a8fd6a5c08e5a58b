"""The laws that come with the library: those of the files next to this one. A new file is a new law, nothing else."""

from __future__ import annotations

from collections.abc import Mapping
from functools import lru_cache, reduce
from operator import or_
from types import MappingProxyType
from typing import Annotated, Any, NamedTuple

from pydantic import BeforeValidator, Field

from tarsus.base.discover import classes_in_folder
from tarsus.model.laws.base import Law


class Slot(NamedTuple):
    """A place in the ground that one law at a time stands in: the type of the field, and what it is for."""

    type: Any
    note: str | None


@lru_cache(maxsize=1)
def built_in() -> Mapping[str, type[Law]]:
    """Laws by name, in the order of their files: every class of a law with parameters or a function."""
    return classes_in_folder(__package__ or "", Law, _name)


def _name(law: type[Law]) -> str | None:
    return law.name() if law.model_fields or law.function() is not None else None


_ORDER = ("rebound", "excess", "strength", "momentum", "force", None, "friction")
"""Order of the slots by hook, as a contact goes: the impact, what holds, the forces; in files and lists of paths."""


@lru_cache(maxsize=1)
def slots() -> Mapping[str, Slot]:
    """The fields of the ground that laws stand in."""
    groups: dict[str, list[type[Law]]] = {}
    for law in built_in().values():
        if law.slot is not None:
            groups.setdefault(law.slot, []).append(law)
    ordered = sorted(groups, key=lambda slot: min(_ORDER.index(law.hook) for law in groups[slot]))
    return MappingProxyType({slot: _slot(slot, groups[slot]) for slot in ordered})


def _slot(slot: str, laws: list[type[Law]]) -> Slot:
    note = next((law.slot_note for law in laws if law.slot_note), None)
    if len(laws) == 1 and "kind" not in laws[0].model_fields:
        return Slot(laws[0], note)
    for law in laws:
        if "kind" not in law.model_fields:
            raise TypeError(
                f"{law.__name__}: laws that share the slot '{slot}' are distinguished by a field kind: Literal[...]"
            )
    kinds = [law.model_fields["kind"].default for law in laws if law.slot_default]

    def kind_given(value: Any) -> Any:
        return {"kind": kinds[0], **value} if kinds and isinstance(value, Mapping) else value

    return Slot(
        Annotated[reduce(or_, laws), Field(discriminator="kind"), BeforeValidator(kind_given)]
        if len(laws) > 1
        else laws[0],
        note,
    )
