"""Sentences for what pydantic found wrong: path, what was expected in physical words, nearest valid name."""

from __future__ import annotations

import difflib
import types
from collections.abc import Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Literal, Union, get_args, get_origin

from pydantic import BaseModel, ValidationError
from pydantic.fields import FieldInfo

from tarsus.base.errors import InputError, InputProblem
from tarsus.base.units import describe_unit

MOST_FAULTS = 100
"""Problems of one file that are listed: nobody mends more at once, and a list of valid names for each takes time."""


class PathErrors(InputError):
    """Problems of a description, each at a path relative to it; the enclosing file's path is put in front."""

    def __init__(self, faults: Iterable[tuple[str, str]]) -> None:
        self.faults: list[tuple[str, str]] = list(faults)
        super().__init__(InputProblem.at(path, text) for path, text in self.faults)

    def __reduce__(self) -> tuple[type[PathErrors], tuple[list[tuple[str, str]]]]:  # type: ignore[override]
        return type(self), (self.faults,)


_SHOWN = 12
"""Names of a list that are shown: some two lines of a terminal."""


def nearest(name: str, valid: Iterable[str]) -> str:
    """``"; did you mean 'x'?"`` for the closest valid name, or a path that ends in the name; else a list of the valid
    ones, else nothing."""
    names = [str(v) for v in valid]
    ending = [n for n in names if name and n.endswith(f".{name}")]
    close = difflib.get_close_matches(name, names, n=1, cutoff=0.65) or ending
    if close:
        return f"; did you mean '{close[0]}'?"
    if not names:
        return ""
    shown = ", ".join(f"'{n}'" for n in names[:_SHOWN])
    return f"; valid names are {shown}{', ...' if len(names) > _SHOWN else ''}"


def some_of(names: Iterable[str]) -> str:
    """``"'a', 'b'"``: the first of some names in quotes, and how many more there are."""
    quoted = [f"'{name}'" for name in names]
    return ", ".join(quoted[:_SHOWN]) + (f" and {len(quoted) - _SHOWN} more" if len(quoted) > _SHOWN else "")


class Hinted:
    """What answers a name that it does not have with the right spelling: that of ``_guesses``, by usual guesses, else
    the nearest of its own names."""

    _guesses: ClassVar[Mapping[str, str]] = {}

    if not TYPE_CHECKING:  # type checkers know which names there are

        def __getattr__(self, name: str) -> Any:
            if hasattr(type(self), name):  # a property of its own that raised: ask again for the error that says why
                return object.__getattribute__(self, name)
            guesses = {} if name.startswith("_") else self._guessed()
            raise AttributeError(no_attribute(f"'{type(self).__name__}' object", name, guesses, dir(type(self))))

    def _guessed(self) -> Mapping[str, str]:
        """The right spelling by names that an object does not have."""
        return self._guesses


def no_attribute(owner: str, name: str, guesses: Mapping[str, str], known: Iterable[str]) -> str:
    """A sentence for a name that an object does not have; guesses: the right spelling by names that it never had."""
    if name.startswith("_"):
        return f"{owner} has no attribute '{name}'"
    near = f"; did you mean {guesses[name]}?" if name in guesses else nearest(name, _public(known))
    return f"{owner} has no attribute '{name}'{near}"


def _public(names: Iterable[str]) -> list[str]:
    return [one for one in names if not one.startswith("_")]


def bounds_text(extra: Mapping[str, Any]) -> str:
    """Words for the bounds of a quantity, such as ``" above 0"`` or ``" from 0 to 1"``."""
    ge, le, gt, lt = (extra.get(k) for k in ("ge", "le", "gt", "lt"))
    if ge is not None and le is not None:
        return f" from {ge:g} to {le:g}"
    parts = []
    if gt is not None:
        parts.append(f"above {gt:g}")
    if ge is not None:
        parts.append(f"of at least {ge:g}")
    if lt is not None:
        parts.append(f"below {lt:g}")
    if le is not None:
        parts.append(f"of at most {le:g}")
    return " " + " and ".join(parts) if parts else ""


def expected_text(field: FieldInfo) -> str:
    """What a field expects, in words: ``"expected a length (m) above 0"``."""
    extra = field.json_schema_extra if isinstance(field.json_schema_extra, dict) else {}
    unit = extra.get("unit")
    if isinstance(unit, str):
        return f"expected {describe_unit(unit)}{bounds_text(extra)}"
    return "expected a value"


def _members(annotation: Any) -> list[Any]:
    """Alternatives of an annotation, without None and without Annotated wrappers (tags are kept)."""
    origin = get_origin(annotation)
    if origin is Annotated:
        inner = get_args(annotation)[0]
        if get_origin(inner) in (Union, types.UnionType):
            return _members(inner)
        return [annotation]
    if origin in (Union, types.UnionType):
        return [m for arg in get_args(annotation) if arg is not type(None) for m in _members(arg)]
    return [annotation]


def _bare(annotation: Any) -> Any:
    return get_args(annotation)[0] if get_origin(annotation) is Annotated else annotation


def alternatives(annotation: Any) -> list[type[BaseModel]]:
    """Description classes of a union, such as every waveform."""
    return [_bare(member) for member in _members(annotation)]


def inside(annotation: Any, key: str) -> Any:
    """Annotation of what stands in a description under a field's name, or in a table or list under any key; None where
    none is known."""
    for one in alternatives(annotation):
        if isinstance(one, type) and issubclass(one, BaseModel):
            field = one.model_fields.get(key)
            return None if field is None else field.annotation
        if get_origin(one) in (dict, tuple):
            return get_args(one)[-1 if get_origin(one) is dict else 0]
    return None


def kind_of(cls: Any) -> str | None:
    """The literal of the ``kind`` field of a description class, if it has one."""
    if isinstance(cls, type) and issubclass(cls, BaseModel) and "kind" in cls.model_fields:
        literal = cls.model_fields["kind"].annotation
        if get_origin(literal) is Literal:
            return str(get_args(literal)[0])
    return None


def locate(cls: Any, loc: tuple[int | str, ...]) -> tuple[list[str], Any, FieldInfo | None]:
    """Dotted path of a pydantic location (union tags removed), annotation there, and the enclosing field."""
    path: list[str] = []
    here: Any = cls
    field: FieldInfo | None = None
    for item in loc:
        if item == "[key]":
            continue
        members = _members(here)
        if len(members) > 1:
            chosen = next((m for m in members if kind_of(_bare(m)) == item or item in _tags(m)), None)
            if chosen is None and "[" in str(item):  # a list or a table: pydantic says which was tried
                chosen = next(
                    (m for m in members if str(item).startswith(getattr(get_origin(m), "__name__", " "))), None
                )
            if chosen is not None:
                here = chosen
                continue
        here = _bare(members[0]) if members else None
        path.append(str(item))
        if isinstance(here, type) and issubclass(here, BaseModel):
            field = here.model_fields.get(str(item))
            here = field.annotation if field is not None else None
            if field is not None and field.discriminator is None:
                continue
        elif get_origin(here) is dict:
            here = get_args(here)[1]
        elif get_origin(here) is tuple:
            here = get_args(here)[0]
        else:
            here = None
    return path, here, field


def _tags(annotation: Any) -> list[str]:
    return [m.tag for m in getattr(annotation, "__metadata__", ()) if type(m).__name__ == "Tag"]


def _shown(value: Any) -> str:
    text = repr(value)
    return text if len(text) <= 60 else text[:57] + "..."


_WANTED = {
    "string_type": "a text",
    "bool_type": "true or false",
    "bool_parsing": "true or false",
    "int_type": "a whole number",
    "int_parsing": "a whole number",
    "int_from_float": "a whole number",
    "dict_type": "a table",
    "mapping_type": "a table",
    "model_type": "a table",
    "model_attributes_type": "a table",
    "tuple_type": "a list",
    "list_type": "a list",
    "float_type": "a number",
    "float_parsing": "a number",
    "finite_number": "a finite number",
}


def fault_sentences(cls: Any, error: Any) -> list[tuple[str, str]]:
    """(path, sentence) of one of the errors that pydantic lists."""
    parts, annotation, field = locate(cls, error["loc"])
    path, code, given = ".".join(parts), error["type"], error["input"]
    cause = error.get("ctx", {}).get("error")
    if isinstance(cause, PathErrors):
        return [(".".join(filter(None, (path, inner))), text) for inner, text in cause.faults]
    if isinstance(cause, Exception):
        return [(path, line) for line in str(cause).splitlines()]
    about = f" ({field.description})" if field is not None and field.description else ""
    if code == "extra_forbidden":
        owner = locate(cls, error["loc"][:-1])[1] if len(error["loc"]) > 1 else cls
        owner = _bare(_members(owner)[0]) if owner is not None else None
        valid = list(owner.model_fields) if isinstance(owner, type) and issubclass(owner, BaseModel) else []
        return [(path, f"unknown name '{parts[-1]}'{_nearest_of(parts[-1], valid, [owner])}")]
    if code == "missing":
        wanted = expected_text(field) if field is not None else "expected a value"
        return [(path, f"missing; {wanted}{about}")]
    if code in ("union_tag_invalid", "union_tag_not_found"):
        members = alternatives(annotation)
        kinds = [k for m in members if (k := kind_of(m)) is not None]
        if code == "union_tag_not_found":
            return [(path, f"expected a table with a 'kind', one of {', '.join(map(repr, kinds))}")]
        tag = str(error["ctx"]["tag"])
        return [(".".join(filter(None, (path, "kind"))), f"unknown kind '{tag}'{_nearest_of(tag, kinds, members)}")]
    if code in ("literal_error", "enum"):
        return [(path, f"expected {error['ctx']['expected']}, got {_shown(given)}{about}")]
    if code == "string_pattern_mismatch":
        return [(path, f"a name is ASCII letters, digits, '_' and '-' only, got {_shown(given)}")]
    wanted = expected_text(field) if field is not None else ""
    if field is not None and "(" in wanted and code in ("float_type", "float_parsing", "finite_number"):
        return [(path, f"{wanted}, got {_shown(given)}{about}")]
    if bounds := bounds_text(error.get("ctx", {})):
        return [(path, f"expected a {'whole ' if isinstance(given, int) else ''}number{bounds}, got {given!r}{about}")]
    if code in _WANTED:
        return [(path, f"expected {_WANTED[code]}, got {_shown(given)}{about}")]
    return [(path, f"{error['msg'][:1].lower()}{error['msg'][1:]}, got {_shown(given)}{about}")]


def _nearest_of(name: str, valid: Sequence[str], owners: Iterable[Any]) -> str:
    """As `nearest`, where descriptions say other words for their kinds and fields."""
    meant = [near for one in owners if (near := getattr(one, "synonyms", {}).get(name.lower())) in valid]
    return f"; did you mean '{meant[0]}'?" if meant else nearest(name, valid)


def meant_kind(name: str, members: Sequence[Any]) -> str | None:
    """The kind of one of these descriptions that is meant by a name: by another word for it, or by its spelling."""
    kinds = [kind for one in members if (kind := kind_of(one)) is not None]
    said = [near for one in members if (near := getattr(one, "synonyms", {}).get(name.lower())) in kinds]
    return next(iter([*said, *difflib.get_close_matches(name, kinds, n=1, cutoff=0.65)]), None)


def located_faults(cls: Any, error: ValidationError) -> list[tuple[str, str]]:
    """Problems in a pydantic error as (path relative to the description, sentence), none twice, `MOST_FAULTS` at most
    and how many more there are."""
    items = error.errors()
    found = list(dict.fromkeys(fault for item in items[:MOST_FAULTS] for fault in fault_sentences(cls, item)))
    more = len(items) - MOST_FAULTS
    return found if more <= 0 else [*found, ("", f"{more} more problems are not listed")]


def sentences(cls: Any, error: ValidationError, prefix: str = "") -> list[InputProblem]:
    """Every problem in a pydantic error as ``"path: sentence"``.

    Parameters
    ----------
    cls
        Description class that was being validated.
    error
        What pydantic raised.
    prefix
        Path of the description inside the file, without a trailing dot.
    """
    faults = located_faults(cls, error)
    return [InputProblem.at(".".join(filter(None, (prefix, path))), text) for path, text in faults]


def together(sentences: Sequence[str]) -> list[str]:
    """Sentences `file: what`, with one for all files of which the same is said."""
    files: dict[str, list[str]] = {}
    for sentence in sentences:
        file, _, said = sentence.partition(": ")
        files.setdefault(said, []).append(file)
    return [f"{of[0]}{f' and {len(of) - 1} more' if len(of) > 1 else ''}: {said}" for said, of in files.items()]
