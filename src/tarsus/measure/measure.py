"""One number with all that says what it means."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from enum import Enum
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from tarsus.base.messages import nearest
from tarsus.core import _native
from tarsus.files.ledger import read_number
from tarsus.files.series import Variable
from tarsus.files.summary import deviation, measures_summary
from tarsus.measure.history import Counting
from tarsus.measure.segments import Floats, Rows
from tarsus.tables.numbers import amount

if TYPE_CHECKING:
    from tarsus.tables.table import Table

RENAMED = {"all_rebounds": "total_rebounds_any_height"}
"""Measures that had another name once."""


def measure_name(name: object) -> str:
    """The name of a measure as typed or as printed: "contact duration" is ``contact_duration``."""
    return str(name).strip().replace(" ", "_").replace("-", "_")


def no_measure(name: str, known: Iterable[str]) -> str:
    """A sentence for a name that no measure has: with its new name, the nearest valid one, or the valid ones."""
    names = list(known)
    renamed = RENAMED.get(name)
    hint = f"; did you mean '{renamed}', its present name?" if renamed in names else nearest(name, names)
    return f"there is no measure '{name}'{hint}"


class Scope(Enum):
    """Whose number a measure is. The value is a word for it."""

    ROBOT = "robot"
    FOOT = "one foot"
    MEAN = "mean over feet"
    WORST = "worst foot"

    def __str__(self) -> str:
        return self.value


@dataclass(frozen=True)
class Measure:
    """One number with its unit, its spread over ``n`` drive periods and its definition.

    scope: whose number ``value`` is; ``per_foot`` has that of each foot. ``spread`` is the standard deviation from
    period to period: of the worst foot, or the largest of the feet. height [m], dwell [s]: what a flight must clear,
    and how short the contact before it must be, to count, where the measure counts (see `Counting`).
    """

    value: float
    unit: str
    spread: float
    n: int
    definition: str
    per_foot: Mapping[str, float] = field(default_factory=dict)
    scope: Scope = Scope.ROBOT
    height: float | None = None
    dwell: float | None = None

    def __str__(self) -> str:
        shown, spread = amount(self.value, self.unit), amount(deviation(self), self.unit, 2)
        return f"{shown} (spread {spread}, n = {self.n}), {self.scope}: {self.definition}"

    @classmethod
    def of(cls, table: Mapping[str, Any]) -> Measure:
        """From plain data that `to_dict` gave; a number that is null is none."""
        per_foot = {foot: read_number(value) for foot, value in table["per_foot"].items()}
        return cls(
            read_number(table["value"]),
            table["unit"],
            read_number(table["spread"]),
            table["n"],
            table["definition"],
            per_foot,
            Scope(table["scope"]),
            table["height_m"],
            table["dwell_s"],
        )

    def to_dict(self) -> dict[str, Any]:
        """As plain data: value, unit, spread, n, definition, scope, height_m, dwell_s (None where nothing is counted),
        per_foot (foot name -> value)."""
        return {
            "value": float(self.value),
            "unit": self.unit,
            "spread": float(self.spread),
            "n": int(self.n),
            "definition": self.definition,
            "scope": str(self.scope),
            "height_m": self.height,
            "dwell_s": self.dwell,
            "per_foot": {foot: float(value) for foot, value in self.per_foot.items()},
        }


class CautionKind(Enum):
    """What a number may mislead about."""

    HIGHEST_UNCOUNTED = "the highest flights are no bounces"
    COUNTED_LOW = "the bounces are low"
    FEW_PERIODS = "too few periods for a spread"


@dataclass(frozen=True)
class Caution:
    """A sentence to read with the measures, and what it is about."""

    kind: CautionKind
    sentence: str

    def __str__(self) -> str:
        return self.sentence


class Measures(Mapping[str, Measure]):
    """Measures by name, as in Python or as printed; also as attributes: ``run.measures.contact_duration``.

    warnings: what to know when reading them.
    """

    def __init__(self, values: Mapping[str, Measure], warnings: Sequence[Caution] = ()) -> None:
        self._values = dict(values)
        self.warnings = tuple(warnings)

    @classmethod
    def of(cls, measures: Mapping[str, Any], warned: Sequence[Mapping[str, str]]) -> Measures:
        """From plain data that `to_dict` and `warned` gave; a warning of a kind that is none any more is left out."""
        kept = [one for one in warned if one["kind"] in CautionKind.__members__]
        return cls(
            {name: Measure.of(one) for name, one in measures.items()},
            [Caution(CautionKind[one["kind"]], one["sentence"]) for one in kept],
        )

    def to_dict(self) -> dict[str, dict[str, Any]]:
        """As plain data: each as `Measure.to_dict`."""
        return {name: one.to_dict() for name, one in self._values.items()}

    @property
    def warned(self) -> list[dict[str, str]]:
        """The warnings as plain data: kind, sentence."""
        return [{"kind": one.kind.name, "sentence": one.sentence} for one in self.warnings]

    def __getitem__(self, name: str) -> Measure:
        found = self._values.get(measure_name(name))
        if found is None:
            raise KeyError(no_measure(name, self._values))
        return found

    def __contains__(self, name: object) -> bool:
        return measure_name(name) in self._values

    def __iter__(self) -> Iterator[str]:
        return iter(self._values)

    def __len__(self) -> int:
        return len(self._values)

    def __getattr__(self, name: str) -> Measure:
        values: dict[str, Measure] = self.__dict__.get("_values", {})  # none yet while it is unpickled
        if name not in values:
            raise AttributeError(no_measure(name, values))
        return values[name]

    def __repr__(self) -> str:
        return f"<Measures: {', '.join(self)}>"

    def _repr_html_(self) -> str:
        return self.table().html()

    def __str__(self) -> str:
        return self.table().text()

    def table(self) -> Table:
        """All measures with their spreads, and the warnings as notes."""
        return measures_summary(self)


@dataclass(frozen=True)
class Moments:
    """Of values laid end to end: how many each owner has (no,), their mean and standard deviation."""

    count: Rows
    mean: Floats
    spread: Floats

    @classmethod
    def of(cls, values: Floats, own: Rows, owners: int) -> Moments:
        """Moments of values (nv,), NaN where there is none, by the number of their owner ``own`` (nv,)."""
        return cls(*_native.moments(np.ascontiguousarray(values, dtype=float), own, owners))


@dataclass(frozen=True)
class Definition:
    """What a measure is: its unit, whose number it is, and words with places for ``span``, ``height`` and ``dwell``."""

    unit: str
    scope: Scope
    words: str


@dataclass(frozen=True)
class Measured:
    """A measure of nr runs: value, spread and n (nr,) as in `Measure`, per_foot (nr, m) where it is of the feet.

    span: over what each value is taken; counting: what counts, of each run.
    """

    value: Floats
    spread: Floats
    n: Rows
    about: Definition
    feet: tuple[str, ...] = ()
    per_foot: Floats | None = None
    span: str = ""
    counting: Counting | None = None

    @property
    def unit(self) -> str:
        """Unit of value and spread."""
        return self.about.unit

    @property
    def scope(self) -> Scope:
        """Whose number the value is."""
        return Scope.FOOT if self.per_foot is not None and len(self.feet) == 1 else self.about.scope

    @property
    def definition(self) -> str:
        """What the number is, in words."""
        return self._words(self.counting)

    def blank(self, runs: int) -> Measured:
        """The same measure of so many runs, of none of which it is known."""
        none = np.full(runs, np.nan)
        feet = None if self.per_foot is None else np.full((runs, len(self.feet)), np.nan)
        counting = Counting(self.counting.height, none.copy()) if self.counting else None
        return Measured(none.copy(), none, np.zeros(runs, np.intp), self.about, self.feet, feet, self.span, counting)

    def put(self, runs: Rows, found: Measured, known: NDArray[np.bool_]) -> None:
        """Enter what was found of these runs, where it is known."""
        at = runs[known]
        self.value[at], self.spread[at], self.n[at] = found.value[known], found.spread[known], found.n[known]
        if self.per_foot is not None and found.per_foot is not None:
            self.per_foot[at] = found.per_foot[known]
        if self.counting and found.counting:
            np.asarray(self.counting.dwell)[runs] = found.counting.dwell

    def _words(self, counting: Counting | None) -> str:
        return self.about.words.format(span=self.span, **(counting.words() if counting else {}))

    def of(self, run: int) -> Measure:
        """The measure of one run."""
        counting = self.counting.of_one(run) if self.counting else None
        per_foot = {} if self.per_foot is None else dict(zip(self.feet, self.per_foot[run].tolist(), strict=True))
        height = counting.height if counting and "{height}" in self.about.words else None
        dwell = float(counting.dwell) if counting and "{dwell}" in self.about.words else None
        return Measure(
            float(self.value[run]),
            self.unit,
            float(self.spread[run]),
            int(self.n[run]),
            self._words(counting),
            per_foot,
            self.scope,
            height,
            dwell,
        )


def of_robot(values: Floats, own: Rows, runs: int, about: Definition) -> Measured:
    """A measure of the robot from its values (nv,) by period, all of a run or none, and the run of each."""
    found = Moments.of(values, own, runs)
    whole = found.count == np.bincount(own, minlength=runs)
    return Measured(
        np.where(whole, found.mean, np.nan),
        np.where(whole, found.spread, np.nan),
        np.where(whole, found.count, 0),
        about,
    )


def of_feet(
    found: Moments,
    runs: int,
    feet: tuple[str, ...],
    about: Definition,
    span: str = "",
    counting: Counting | None = None,
) -> Measured:
    """A measure of the feet of nr runs from their moments, those of foot f of run r at number ``r m + f``.

    The scope says of several feet whether it is their mean or that of the worst foot, the one with the largest mean.
    """
    mean = found.mean.reshape(runs, len(feet))
    if not feet:
        none = np.full(runs, np.nan)
        return Measured(none, none.copy(), np.zeros(runs, dtype=np.intp), about, feet, mean, span, counting)
    worst = about.scope is Scope.WORST
    seen, value, spread = _native.over_feet(found.count, found.mean, found.spread, len(feet), worst)
    return Measured(value, spread, seen, about, feet, mean, span, counting)


def measure_variables(
    name: str,
    about: Measure | Measured,
    dims: tuple[str, ...],
    value: np.ndarray,
    spread: np.ndarray,
    per_foot: np.ndarray | None,
    notes: Mapping[str, Any],
) -> dict[str, Variable]:
    """A measure as variables over ``dims``: value and spread of their shape, and that of each foot where given."""
    notes = {"units": about.unit, "scope": str(about.scope), **notes}
    out = {
        name: Variable(dims, value, {"long_name": about.definition, **notes}),
        f"{name}_spread": Variable(
            dims, spread, {"long_name": f"standard deviation of {name} from period to period", **notes}
        ),
    }
    if per_foot is not None:
        out[f"{name}_per_foot"] = Variable((*dims, "foot"), per_foot, {"long_name": f"{name} of each foot", **notes})
    return out
