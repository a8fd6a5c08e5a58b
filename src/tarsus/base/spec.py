"""Descriptions of physical things: frozen, validated, and addressable by dotted paths.

Every physical object of the project is a `Description`.  A field made by `quantity` carries its SI unit,
bounds and meaning, takes unit strings (``"70 um"``) as well as SI floats, and holds SI floats.  Any value
inside is addressed by a path such as ``ground.film.coefficient`` or ``robot.structure.damping_ratios.0``:
the same path for ``--set``, sweeps, fits and provenance.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import FrozenInstanceError, dataclass
from functools import lru_cache
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, NamedTuple, TypeVar

import numpy as np
from pydantic import (
    AfterValidator,
    BaseModel,
    ConfigDict,
    Field,
    GetCoreSchemaHandler,
    StringConstraints,
    ValidationError,
)
from pydantic.fields import FieldInfo
from pydantic_core import CoreSchema, core_schema

from tarsus.base.errors import InputError, InputProblem
from tarsus.base.messages import (
    PathErrors,
    alternatives,
    bounds_text,
    inside,
    kind_of,
    nearest,
    no_attribute,
    sentences,
)
from tarsus.base.units import describe_unit, parse_quantity

__all__ = [
    "Amount",
    "Amounts",
    "Description",
    "FloatInfo",
    "FrozenDict",
    "MaybeAmount",
    "Name",
    "Named",
    "by_path",
    "float_paths",
    "get_value",
    "number_paths",
    "one_number",
    "paths_of",
    "quantity",
    "quantity_units",
    "validate",
    "with_values",
]

K = TypeVar("K")
V = TypeVar("V")
T = TypeVar("T")
D = TypeVar("D", bound="Description")

_REQUIRED: Any = object()


class FrozenDict(dict[K, V]):
    """A dictionary that cannot be changed and can be hashed."""

    def _refuse(self, *args: object, **kwargs: object) -> Any:
        raise TypeError("descriptions are frozen: make a changed copy with tarsus.with_values")

    def __missing__(self, key: object) -> Any:
        raise KeyError(f"there is no '{key}'{nearest(str(key), map(str, self))}")

    def __getattr__(self, name: str) -> Any:
        """A value by its name, so that a path such as ``scene.robot.feet.tip.gap`` is Python too."""
        if name not in self or name.startswith("__"):
            raise AttributeError(f"there is no '{name}'{nearest(name, map(str, self))}")
        return self[name]  # pyright: ignore[reportArgumentType]

    __setitem__ = __delitem__ = __ior__ = _refuse  # pyright: ignore[reportAssignmentType]
    clear = pop = popitem = setdefault = update = _refuse  # pyright: ignore[reportAssignmentType]

    def __hash__(self) -> int:  # type: ignore[override]
        return hash(frozenset(self.items()))

    def __reduce__(self) -> tuple[Any, ...]:
        return FrozenDict, (dict(self),)

    def __copy__(self) -> FrozenDict[K, V]:
        return self

    def __deepcopy__(self, memo: dict[int, Any]) -> FrozenDict[K, V]:
        return self


Name = Annotated[str, StringConstraints(pattern=r"^[A-Za-z0-9_][A-Za-z0-9_-]*$")]


def scene_name(text: str) -> str:
    """A name that descriptions take, of any text: what they do not allow becomes ``_``, ``12_Z`` of ``12+Z``."""
    return re.sub(r"[^A-Za-z0-9_-]+", "_", text).lstrip("-") or "_"


Named = Annotated[dict[Name, T], AfterValidator(FrozenDict)]
"""``Named[Drive]``: a frozen table of descriptions by name; names hold no dots, so that paths are unique."""


if TYPE_CHECKING:

    class Amount:
        """A field that is a float, and takes texts with a unit: what type checkers see."""

        def __get__(self, owner: Any, kind: Any, /) -> float: ...
        def __set__(self, owner: Any, value: float | str) -> None: ...

    class MaybeAmount:
        """The same of a number that need not be there."""

        def __get__(self, owner: Any, kind: Any, /) -> float | None: ...
        def __set__(self, owner: Any, value: float | str | None) -> None: ...

    class Amounts:
        """The same of a row of numbers."""

        def __get__(self, owner: Any, kind: Any, /) -> tuple[float, ...]: ...
        def __set__(self, owner: Any, value: Sequence[float | str] | np.ndarray) -> None: ...

else:
    Amount = float
    MaybeAmount = float | None
    Amounts = tuple[float, ...]


def quantity(
    unit: str,
    doc: str,
    *,
    default: Any = _REQUIRED,
    gt: float | None = None,
    ge: float | None = None,
    lt: float | None = None,
    le: float | None = None,
) -> Any:
    """A field that holds a physical quantity: a float, or a (nested) tuple or table of floats.

    Parameters
    ----------
    unit
        SI unit of every float of the field: ``"m"``, ``"N m^2 s"``, ``"1"`` for a pure number.
    doc
        What it is, as a phrase; shown in errors and by ``tarsus show``.
    default
        Value when absent; required when not given.  ``None`` needs an annotation that allows it.
    gt, ge, lt, le
        Bounds that every float must keep.

    Returns
    -------
    Any
        What stands in the place of a default in the class of a description.
    """
    bounds = {k: v for k, v in (("gt", gt), ("ge", ge), ("lt", lt), ("le", le)) if v is not None}
    extra: dict[str, Any] = {"unit": unit, **bounds}
    given = {} if default is _REQUIRED else {"default": default}
    field: FieldInfo = Field(description=doc, json_schema_extra=extra, **given)
    field.metadata.append(_Quantity(unit, doc, bounds))
    return field


@dataclass(frozen=True, eq=False)
class _Quantity:
    """Marks a field as a physical quantity and turns what is given into SI floats before validation."""

    unit: str
    doc: str
    bounds: Mapping[str, float]

    def convert(self, value: Any) -> Any:
        if value is None:
            return value
        faults: list[tuple[str, str]] = []
        converted = _to_si(value, self, "", faults)
        if faults:
            raise PathErrors(faults)
        return converted

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> CoreSchema:
        return core_schema.no_info_before_validator_function(self.convert, handler(source))


@lru_cache(maxsize=1024)
def _quantities(cls: type[BaseModel]) -> dict[str, _Quantity]:
    return {
        name: item for name, field in cls.model_fields.items() for item in field.metadata if isinstance(item, _Quantity)
    }


def quantity_units(cls: type[BaseModel]) -> dict[str, str]:
    """SI unit of every field of a description class that is a quantity."""
    return {name: spec.unit for name, spec in _quantities(cls).items()}


LEAST, MOST = 1e-60, 1e60
"""Least size of a quantity that must be above 0, and largest of any [SI]: products of five are numbers still, as masses
are of lengths and densities. Nature's own constants lie within 1e-35 and 1e35."""


def _inside(value: float, bounds: Mapping[str, float]) -> bool:
    return (
        abs(value) <= MOST
        and (bounds.get("gt") != 0.0 or value >= LEAST)
        and value > bounds.get("gt", -math.inf)
        and value >= bounds.get("ge", -math.inf)
        and value < bounds.get("lt", math.inf)
        and value <= bounds.get("le", math.inf)
    )


def _to_si(value: Any, spec: _Quantity, path: str, faults: list[tuple[str, str]]) -> Any:
    """SI floats of a raw value (number, unit string, or nested lists and tables of them)."""
    if type(value) is float and _inside(value, spec.bounds):
        return value
    if isinstance(value, (np.ndarray, np.generic)):
        value = value.tolist()
    if isinstance(value, (list, tuple)):
        if len(value) > 64 and all(type(v) is float for v in value):
            ends = np.asarray(value)
            if _inside(float(ends.min()), spec.bounds) and _inside(float(ends.max()), spec.bounds):
                return tuple(value)
        return tuple(_to_si(v, spec, f"{path}.{i}" if path else str(i), faults) for i, v in enumerate(value))
    if isinstance(value, dict):
        return {k: _to_si(v, spec, f"{path}.{k}" if path else str(k), faults) for k, v in value.items()}
    if isinstance(value, bool) or not isinstance(value, (str, int, float)):
        return value
    about = f" ({spec.doc})" if spec.doc else ""
    try:
        number = parse_quantity(value, spec.unit)
    except InputError as error:
        faults.append((path, f"{error}{about}"))
        return value
    if not _inside(number, spec.bounds):
        wanted = f"expected {describe_unit(spec.unit)}{bounds_text(spec.bounds)}"
        extreme = math.isfinite(number) and (abs(number) > MOST or 0.0 < number < LEAST)
        size = f" with a size from {LEAST:g} to {MOST:g} in SI" if extreme else ""
        faults.append((path, f"{wanted}{size}, got {value if isinstance(value, str) else repr(number)}{about}"))
    return number


class Description(BaseModel):
    """Base of every description: frozen, no unknown names, no NaN or infinity, hashable, equal by value.

    Raises
    ------
    InputError
        On construction, with every problem at once.
    """

    synonyms: ClassVar[Mapping[str, str]] = {}
    """What others call its kind or its fields: by their word the name here, which is suggested."""

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False, protected_namespaces=())

    def __init__(self, /, **data: Any) -> None:
        __tracebackhide__ = True
        try:
            self.__pydantic_validator__.validate_python(data, self_instance=self)
        except ValidationError as error:
            raise InputError(sentences(type(self), error, type(self).__name__)) from None

    # Nested descriptions are built by the validator itself, so that all their errors come at once.
    __init__.__pydantic_base_init__ = True  # type: ignore[attr-defined]

    def __setattr__(self, name: str, value: Any) -> None:
        raise FrozenInstanceError(f"a {type(self).__name__} is frozen: change {name} in a copy, by tarsus.with_values")

    if not TYPE_CHECKING:  # type checkers know which names there are

        def __getattr__(self, name: str) -> Any:
            try:
                return super().__getattr__(name)
            except AttributeError:
                if name.startswith("_") or hasattr(type(self), name):
                    raise
            known = [*type(self).model_fields, *vars(type(self))]
            raise AttributeError(no_attribute(f"'{type(self).__name__}' object", name, {}, known))

    def short_words(self) -> Mapping[str, tuple[str, ...]]:
        """Words that stand for numbers wherever a path does, with the paths of these; none unless a class has some."""
        return {}


class FloatInfo(NamedTuple):
    """One float of a description: SI value, SI unit, meaning."""

    value: float
    unit: str
    doc: str


def validate(
    cls: type[D],
    data: Any,
    *,
    prefix: str = "",
    context: dict[str, Any] | None = None,
    further: Callable[[D], list[str]] | None = None,
) -> D:
    """A description from raw tables; raises `InputError` with every problem, each with its path.

    Parameters
    ----------
    cls
        Description class.
    data
        Mapping of raw values (as read from a file), or an instance.
    prefix
        Path of the description in its file, put before every problem.
    context
        Passed to validators (classes of user laws).
    further
        Problems of a description that is valid in itself, each a sentence with its path.
    """
    try:
        found = cls.__pydantic_validator__.validate_python(data, context=context)
    except ValidationError as error:
        from tarsus.base.faults import all_faults  # where something is wrong, and never else

        faults = all_faults(cls, data, error, context, further)
    else:
        faults = [("", said) for said in further(found)] if further is not None else []
        if not faults:
            return found
    whole = ((".".join(filter(None, (prefix, path))), text) for path, text in faults)
    raise InputError(InputProblem.at(path, text) for path, text in whole)


def _children(node: Any) -> Iterator[tuple[str, Any]]:
    if isinstance(node, Description):
        for name in type(node).model_fields:
            yield name, getattr(node, name)
    elif isinstance(node, dict):
        yield from ((str(k), v) for k, v in node.items() if "." not in str(k))
    elif isinstance(node, tuple):
        yield from ((str(i), v) for i, v in enumerate(node))


def _leaves(node: Any, path: str, spec: _Quantity) -> Iterator[tuple[str, Any, _Quantity]]:
    """Every value that is no container, with its path and the quantity it belongs to."""
    if not isinstance(node, (Description, dict, tuple)):
        yield path, node, spec
        return
    own = _quantities(type(node)) if isinstance(node, Description) else {}
    for name, child in _children(node):
        yield from _leaves(child, f"{path}.{name}" if path else name, own.get(name, spec))


_BARE = _Quantity("1", "", {})


def described(desc: object) -> None:
    """Raise InputError for what is no description, such as the name of one."""
    if not isinstance(desc, Description):
        load = "; tarsus.load_scene reads a device or a scene file" if isinstance(desc, str) else ""
        raise InputError(f"expected a description, such as a Scene, got {desc!r:.60}{load}")


def float_paths(desc: Description) -> dict[str, FloatInfo]:
    """Every float of a description by path, in file order.

    Returns
    -------
    dict[str, FloatInfo]
        ``{"ground.film.coefficient": FloatInfo(value, unit, doc), ...}``; absent (None) values are omitted.

    Raises
    ------
    InputError
        For what is no description, such as a device's name.
    """
    described(desc)
    return {
        path: FloatInfo(value, spec.unit, spec.doc)
        for path, value, spec in _leaves(desc, "", _BARE)
        if type(value) is float
    }


def number_at(desc: Description, path: str) -> FloatInfo:
    """The number at a path of a description, NaN where it is not set."""
    found = get_value(desc, path)
    spec = next((spec for at, _, spec in _leaves(desc, "", _BARE) if at == path), _BARE)
    return FloatInfo(found if isinstance(found, float) else np.nan, spec.unit, spec.doc)


def _step(node: Any, key: str) -> Any:
    """Child of a node by name or index; KeyError if there is none."""
    if isinstance(node, Description):
        if key not in type(node).model_fields:
            raise KeyError(key)
        return getattr(node, key)
    if isinstance(node, dict):
        return node[key]
    if isinstance(node, tuple) and key.isdecimal() and int(key) < len(node):
        return node[int(key)]
    raise KeyError(key)


def _unknown(desc: Description, path: str) -> str:
    """Sentence for a path that does not exist."""
    node, keys = desc, path.split(".")
    for depth, key in enumerate(keys):
        try:
            node = _step(node, key)
        except KeyError:
            parent = ".".join(keys[:depth])
            if node is None:
                return f"{path}: '{parent}' is not set here, so '{key}' has nothing to act on"
            words = desc.short_words()
            hint = nearest(path, [*words, *(p for p, _, _ in _leaves(desc, "", _BARE))])
            if "did you mean" not in hint:
                hint = nearest(key, [name for name, _ in _children(node)]) or f"; '{parent}' is one value"
                if depth == 0 and words:
                    hint += f"; short words are {', '.join(map(repr, words))}"
            return f"{path}: unknown path{hint}"
    return f"{path}: unknown path"


def paths_of(desc: Description, name: str) -> tuple[str, ...]:
    """Paths that a path or a short word stands for. Raises InputError for what is neither, with the nearest of both."""
    paths = desc.short_words().get(name, (name,))
    for path in paths:
        get_value(desc, path)
    return paths


def number_paths(desc: Description, name: str) -> tuple[str, ...]:
    """Paths of the numbers that a path or a short word stands for.

    Raises InputError as `paths_of` does, and for what is no number with a fraction or not set.
    """
    paths = paths_of(desc, name)
    for path in paths:
        found = get_value(desc, path)
        if found is None:
            raise InputError([f"{path}: is not set here, so it has no value that could vary: set it first"])
        if not isinstance(found, float):
            inside = [p for p, value, _ in _leaves(found, "", _BARE) if p and type(value) is float]
            many = f"is a table or list; name one number inside, such as {path}.{inside[0]}" if inside else ""
            raise InputError([f"{path}: {many or f'is {found!r}, and no number that varies'}"])
    return paths


def one_number(desc: Description, name: str) -> str:
    """The path of the one number that a path or a short word stands for.

    Raises InputError as `number_paths` does, and for a word that stands for several.
    """
    first, *others = number_paths(desc, name)
    if others:
        raise InputError([f"{name}: stands for {' and '.join((first, *others))} here; name one of them"])
    return first


def by_path(desc: Description, values: Mapping[str, T]) -> dict[str, T]:
    """Values by path, with each short word replaced by the paths of all numbers that it stands for.

    Raises InputError where a number is given twice so.
    """
    words = desc.short_words() if any("." not in name for name in values) else {}
    out: dict[str, T] = {}
    for name, value in values.items():
        for path in words.get(name, (name,)):
            if path in out or (path != name and path in values):
                raise InputError([f"{path}: is given twice, once as '{name}'"])
            out[path] = value
    return out


def get_value(desc: Description, path: str) -> Any:
    """Value at a path: a float, another field, or a whole sub-description.

    Returns
    -------
    Any
        A float in SI, or what the field holds.

    Raises
    ------
    InputError
        For an unknown path, with the nearest valid one.
    """
    described(desc)
    if "." not in path and (meant := desc.short_words().get(path)):
        found = [get_value(desc, one) for one in meant]
        if any(one != found[0] for one in found):
            raise InputError([f"{path}: stands for {' and '.join(meant)} here, which differ; name one of them"])
        return found[0]
    node: Any = desc
    for key in path.split("."):
        try:
            node = _step(node, key)
        except KeyError:
            raise InputError(_unknown(desc, path)) from None
    return node


class _Leaf(NamedTuple):
    value: Any


def _tree(values: Mapping[str, Any]) -> dict[str, Any]:
    tree: dict[str, Any] = {}
    for path, value in values.items():
        *parents, last = path.split(".")
        node = tree
        for key in parents:
            node = node.setdefault(key, {})
            if isinstance(node, _Leaf):
                raise InputError(f"{path}: '{key}' is also given as a whole; give one of the two")
        if last in node:
            raise InputError(f"{path}: a value inside it is also given; give one of the two")
        node[last] = _Leaf(value)
    return tree


def _changed(
    root: Description, node: Any, tree: Mapping[str, Any], path: str, problems: list[str], slot: Any = None
) -> Any:
    """A node with what a tree changes; slot: annotation of where it stands, whose classes its kind may be of."""
    changes: dict[str, Any] = {}
    kept = _kept(node, tree.get("kind"), slot)
    for key, sub in tree.items():
        inner = f"{path}.{key}" if path else key
        try:
            old = _step(node, key)
        except KeyError:
            whole = isinstance(sub, _Leaf) and isinstance(sub.value, (dict, Description))
            if isinstance(sub, _Leaf) and (kept is not None or (isinstance(node, FrozenDict) and whole)):
                changes[key] = sub.value
                continue
            bad = inner if isinstance(sub, _Leaf) else f"{inner}.{next(iter(_flat(sub)))}"
            problems.append(_unknown(root, bad))
            continue
        if isinstance(sub, _Leaf):
            changes[key] = sub.value
        else:
            below = inside(type(node) if isinstance(node, Description) else slot, key)
            changes[key] = _changed(root, old, sub, inner, problems, below)
    if kept is not None:
        return {**kept, **changes}
    if isinstance(node, tuple):
        items = list(node)
        for key, value in changes.items():
            items[int(key)] = value
        return tuple(items)
    if isinstance(node, dict):
        return {**node, **changes}
    if not isinstance(node, Description) or not changes:
        return node
    try:
        return type(node).__pydantic_validator__.validate_python({**node.__dict__, **changes})
    except ValidationError as error:
        problems.extend(sentences(type(node), error, path))
        return node


def _kept(node: Any, asked: Any, slot: Any) -> dict[str, Any] | None:
    """What a part of another kind keeps: the fields that both kinds have by one name and unit; None where the kind is
    not asked for, stays, or is the only one."""
    if not isinstance(asked, _Leaf) or asked.value == kind_of(type(node)):
        return None
    members = alternatives(slot)
    if len(members) < 2:
        return None
    cls = next((one for one in members if kind_of(one) == asked.value), type(node))
    mine, others = quantity_units(type(node)), quantity_units(cls)
    return {
        name: getattr(node, name)
        for name in type(node).model_fields
        if name in cls.model_fields and mine.get(name) == others.get(name)
    }


def _flat(tree: Mapping[str, Any]) -> Iterator[str]:
    for key, sub in tree.items():
        if isinstance(sub, _Leaf):
            yield key
        else:
            yield from (f"{key}.{rest}" for rest in _flat(sub))


def with_values(desc: D, values: Mapping[str, Any]) -> D:
    """A changed copy of a description; only what lies on the given paths is rebuilt and validated.

    Parameters
    ----------
    desc
        Any description.
    values
        Path, or short word such as ``volts`` (`Description.short_words`), to new value: a float in SI, a unit string,
        or whatever the field takes (a whole sub-description, a table, None). Another ``kind``, as of ``gait.kind``,
        keeps all that both kinds have.

    Returns
    -------
    D
        Of the same class; the original is unchanged.

    Raises
    ------
    InputError
        With every unknown path (and the nearest valid one) and every refused value.
    """
    described(desc)
    problems: list[str] = []
    changed = _changed(desc, desc, _tree(by_path(desc, values)), "", problems)
    if problems:
        raise InputError(problems)
    return changed
