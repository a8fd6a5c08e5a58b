"""Every fault of a file at once: what is wrong is put right, so that what depends on it is looked at too.

A validator of a whole (a walker's feet, a gait on its legs) is asked once all its parts are right. So the faults of one
look are taken out of a copy of the table, by the nearest valid name or a number within its bounds, and the copy is
looked at again; where parts are right and their whole is not, its own checks are left out from then on. What is said of
a stand-in itself is repeated to nobody.
"""

from __future__ import annotations

import types
from collections.abc import Callable, Mapping
from functools import lru_cache
from typing import Annotated, Any, Literal, Union, get_args, get_origin

from pydantic import BaseModel, ValidationError
from pydantic.fields import FieldInfo
from pydantic_core import SchemaValidator

from tarsus.base.messages import MOST_FAULTS, PathErrors, alternatives, fault_sentences, kind_of, locate, meant_kind

LOOKS = 12
"""Looks at one table: each goes a level further out, and no file is nested as deep."""

UNKNOWN = "?"
"""Stands for a name that is not given."""


class _Opaque(Exception):
    """No stand-in exists: names or sizes would have to be made up, and others depend on them."""


def all_faults(
    cls: type[BaseModel],
    table: Any,
    error: ValidationError,
    context: dict[str, Any] | None,
    further: Callable[[Any], list[str]] | None = None,
) -> list[tuple[str, str]]:
    """(path, sentence) of everything that is wrong with a table in which `error` was found.

    further: problems of a description that is right so far, each a sentence with its path.
    """
    look = _Look(cls, _copied(table))
    more = len(error.errors()) - MOST_FAULTS
    if more > 0:
        look.take(error)
        return [*list(look.found)[:MOST_FAULTS], ("", f"{more} more problems are not listed")]
    for _ in range(LOOKS):
        if not look.take(error):
            return list(look.found)
        try:
            seen = _validator(cls, frozenset(look.judged)).validate_python(look.table, context=context)
        except ValidationError as another:
            error = another
        except Exception:  # a check met parts that do not go together, which was said already
            return list(look.found)
        else:
            said = further(seen) if further is not None and not look.opaque else []
            return [*look.found, *(("", one) for one in said)]
    return list(look.found)


class _Look:
    """A copy of a table that is put right step by step, and what was found in it. hidden: paths of stand-ins; opaque:
    paths below which names or sizes are missing, so that no whole around them can be judged; judged: classes whose
    checks of the whole have said what they had to say."""

    def __init__(self, cls: type[BaseModel], table: Any) -> None:
        self.cls, self.table = cls, table
        self.found: dict[tuple[str, str], None] = {}
        self.hidden: set[str] = set()
        self.opaque: set[str] = set()
        self.judged: set[type[BaseModel]] = set()

    def take(self, error: ValidationError) -> bool:
        """Note what an error says and put it right; whether anything changed."""
        changed, wholes = False, set()
        for item in error.errors()[:MOST_FAULTS]:
            parts, annotation, field = locate(self.cls, item["loc"])
            whole = self._whole(item, parts, annotation)
            self._note(item, ".".join(parts), whole)
            if whole is not None:
                wholes.add(whole)
                self._nameless(item, parts)
                continue
            try:
                changed |= self._mend(item, parts, annotation, field)
            except _Opaque:
                changed |= self._left_out(parts)
        if changed or wholes <= self.judged:
            return changed
        self.judged |= wholes
        return True

    def _note(self, item: Any, at: str, whole: type[BaseModel] | None) -> None:
        inside = f"{at}." if at else ""
        if whole is None or not any(one.startswith(inside) for one in self.opaque):
            said = (one for one in fault_sentences(self.cls, item) if one[0] not in self.hidden)
            self.found.update(dict.fromkeys(said))

    def _whole(self, item: Any, parts: list[str], annotation: Any) -> type[BaseModel] | None:
        """The class that refuses parts which are right each by itself; None of any other fault."""
        if item["type"] not in ("value_error", "assertion_error"):
            return None
        return _class_of(annotation) if parts else self.cls

    def _nameless(self, item: Any, parts: list[str]) -> None:
        """An empty table that a whole refuses names nothing: what would name its parts is no fault of its own."""
        cause = item.get("ctx", {}).get("error")
        for path in (path for path, _ in cause.faults) if isinstance(cause, PathErrors) else ():
            at = [*parts, *filter(None, path.split("."))]
            if self._at(at) in ({}, []):
                self.opaque.add(".".join(at))

    def _mend(self, item: Any, parts: list[str], annotation: Any, field: FieldInfo | None) -> bool:
        """Put one fault right; whether anything changed."""
        node = self._at(parts[:-1])
        if not parts or not isinstance(node, (dict, list)):
            return False
        last: Any = int(parts[-1]) if isinstance(node, list) else parts[-1]
        code, cause = item["type"], item.get("ctx", {}).get("error")
        if code == "extra_forbidden":
            return isinstance(node, dict) and node.pop(last, self) is not self
        if code.startswith("union_tag"):
            return self._kind(node, last, parts, annotation)
        inner = [path for path, _ in cause.faults if path] if isinstance(cause, PathErrors) else []
        if inner and field is not None:
            return all([self._number([*parts, *path.split(".")], field) for path in inner])
        return self._stand_in(node, last, parts, field)

    def _kind(self, node: Any, last: Any, parts: list[str], annotation: Any) -> bool:
        """A table without a kind, or of one that does not exist, becomes the kind that is meant."""
        given, members = node[last], alternatives(annotation)
        if not isinstance(given, dict):
            self.opaque.add(".".join(parts))
            node[last] = _whole_stand_in(annotation)
            return True
        kinds = [kind for one in members if (kind := kind_of(one)) is not None]
        meant = meant_kind(str(given.get("kind", "")), members)
        if meant is None:
            shared = [len(set(given) & set(one.model_fields) - {"kind"}) for one in members]
            if not any(shared):
                self.opaque.add(".".join(parts))
                node[last] = _whole_stand_in(annotation)
                return True
            meant = kinds[shared.index(max(shared))]
        given["kind"] = meant
        return True

    def _number(self, parts: list[str], field: FieldInfo) -> bool:
        """One number of a list or table takes its stand-in."""
        node: Any = self._at(parts[:-1])
        if not isinstance(node, (dict, list)):
            return False
        last: Any = int(parts[-1]) if isinstance(node, list) else parts[-1]
        node[last] = _number_for(field)
        self.hidden.add(".".join(parts))
        return True

    def _stand_in(self, node: Any, last: Any, parts: list[str], field: FieldInfo | None) -> bool:
        path = ".".join(parts)
        self.hidden.add(path)
        if field is None:
            return isinstance(node, dict) and node.pop(last, self) is not self
        try:
            node[last] = _value_for(field.annotation, field)
        except _Opaque:
            self.opaque.add(path)
            raise
        return True

    def _left_out(self, parts: list[str]) -> bool:
        """A part without a stand-in is left out."""
        node = self._at(parts[:-1])
        return isinstance(node, dict) and node.pop(parts[-1], self) is not self

    def _at(self, parts: list[str]) -> Any:
        node = self.table
        for part in parts:
            try:
                node = node[int(part)] if isinstance(node, list) else node[part]
            except (KeyError, IndexError, TypeError, ValueError):
                return None
        return node


@lru_cache(maxsize=64)
def _validator(cls: type[BaseModel], judged: frozenset[type[BaseModel]]) -> Any:
    """The validator of a class in which some classes take their parts without asking whether they go together."""
    return (
        SchemaValidator(_without_checks(cls.__pydantic_core_schema__, judged)) if judged else cls.__pydantic_validator__
    )


def _without_checks(node: Any, judged: frozenset[type[BaseModel]]) -> Any:
    """A schema of pydantic without the functions that are called after these classes."""
    if isinstance(node, list):
        return [_without_checks(one, judged) for one in node]
    if not isinstance(node, dict):
        return node
    inner = node
    while inner.get("type") == "function-after":
        inner = inner["schema"]
    if inner.get("type") == "model" and inner["cls"] in judged:
        node = inner | ({"ref": node["ref"]} if "ref" in node else {})
    return {key: _without_checks(one, judged) for key, one in node.items()}


def _copied(node: Any) -> Any:
    if isinstance(node, Mapping):
        return {key: _copied(one) for key, one in node.items()}
    return [_copied(one) for one in node] if isinstance(node, (list, tuple)) else node


def _bare(annotation: Any) -> Any:
    return get_args(annotation)[0] if get_origin(annotation) is Annotated else annotation


def _class_of(annotation: Any) -> type[BaseModel] | None:
    bare = _bare(annotation)
    return bare if isinstance(bare, type) and issubclass(bare, BaseModel) else None


def _extra(field: FieldInfo) -> dict[str, Any]:
    return field.json_schema_extra if isinstance(field.json_schema_extra, dict) else {}


def _number_for(field: FieldInfo) -> float:
    """A number that a quantity may have: 1, or the middle of its bounds, or 1 beyond the one that it has."""
    extra = _extra(field)
    low, high = extra.get("gt", extra.get("ge")), extra.get("lt", extra.get("le"))
    if low is not None and high is not None:
        return 0.5 * (low + high)
    return 1.0 + (low or 0.0) if high is None else high - 1.0


def _value_for(annotation: Any, field: FieldInfo) -> Any:
    """A stand-in for a field's value. Raises _Opaque where names or sizes would have to be made up."""
    extra, bare = _extra(field), _bare(annotation)
    if get_origin(bare) in (Union, types.UnionType):
        options = [one for one in get_args(bare) if one is not type(None)]
        bare = options[0] if len(options) == 1 else bare
    if "unit" in extra and bare is float:
        return _number_for(field)
    if get_origin(bare) is Literal:
        return get_args(bare)[0]
    plain = {str: UNKNOWN, bool: False, int: 1, float: 1.0}
    if bare in plain:
        return plain[bare]
    if "unit" in extra:
        raise _Opaque
    return _whole_stand_in(annotation)


def _whole_stand_in(annotation: Any) -> Any:
    """The first of the descriptions that a place takes, of stand-ins."""
    members = [one for one in alternatives(annotation) if _class_of(one) is not None]
    if not members:
        raise _Opaque
    given = {
        name: _value_for(one.annotation, one) for name, one in members[0].model_fields.items() if one.is_required()
    }
    kind = kind_of(members[0])
    return given | ({} if kind is None else {"kind": kind})
