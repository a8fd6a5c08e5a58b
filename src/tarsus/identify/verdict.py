"""Is it determined? For every number its range, what it hangs together with, and a verdict with a sentence."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tarsus.base.arrays import Floats
from tarsus.base.errors import InputError
from tarsus.fit.ranges import Range, range_of
from tarsus.fit.verdict import Verdict, verdict_of
from tarsus.identify.correlation import Combination, correlation, find_product
from tarsus.tables.numbers import amount

_RELATED = 0.5
"""Correlation from which on another number is named: a quarter of the variance in common."""


@dataclass(frozen=True)
class NumberVerdict:
    """What data say of one number.

    range: where it lies, with the verdict; combination: a product with another one that the data determine where they
    do not determine the number; related: where they determine neither, the other numbers it is most correlated with,
    and how much; doubts: checks of the model that have failed and that it depends on, in words; far: by how much it may
    be off because of these [SI], NaN where they do not tell.
    """

    name: str
    range: Range
    combination: Combination | None = None
    related: tuple[tuple[str, float], ...] = ()
    doubts: tuple[str, ...] = ()
    far: float = np.nan

    @property
    def determined(self) -> bool:
        """Whether the data fix the number."""
        return self.range.verdict is Verdict.DETERMINED

    @property
    def word(self) -> str:
        """In a word, for tables."""
        assert self.range.verdict is not None
        return self.range.verdict.value

    def sentence(self, unit: str = "1") -> str:
        """In words, with the range in ``unit``; a combination is in SI."""
        if self.determined:
            return f"{self.name} is determined: {self.range.text(unit)} ({100 * self.range.level:g} %)."
        if self.range.verdict is Verdict.PREFERRED:
            far = "" if np.isnan(self.far) else f", and may be wrong by {amount(self.far, unit, 2)}"
            return f"{self.name} is preferred: {self.range.text(unit)}{far}; but {'; and '.join(self.doubts)}."
        if self.combination is None:
            tied = ", ".join(f"{name} ({value:+.2f})" for name, value in self.related)
            more = f"; it is correlated with {tied}" if tied else ""
            return f"{self.name} is not determined by these data: they leave it {_free(self.range, unit)}{more}."
        partners = " and ".join(name for name in self.combination.names if name != self.name)
        fixed = self.combination.interval
        return (
            f"{self.name} is determined only together with {partners}: these data fix {self.combination} = "
            f"{fixed.value:.4g} (SI) within {100.0 * fixed.half_width(abs(fixed.value)):.2g} %, and leave {self.name} "
            f"alone {_free(self.range, unit)}."
        )


@dataclass(frozen=True)
class Assessment:
    """What data say of np numbers.

    names; correlation (np, np), NaN where one does not vary; verdicts (np); basis: what they rest on.
    """

    names: tuple[str, ...]
    correlation: Floats
    verdicts: tuple[NumberVerdict, ...]
    basis: str

    def __getitem__(self, name: str) -> NumberVerdict:
        return self.verdicts[self.names.index(name)]

    def range(self, name: str) -> Range:
        """Range of one number, SI."""
        return self[name].range

    @property
    def combinations(self) -> tuple[Combination, ...]:
        """Every combination that a verdict names, once."""
        found = [one.combination for one in self.verdicts if one.combination is not None]
        return tuple({one.names: one for one in found}.values())

    def sentences(self, units: Mapping[str, str] | None = None) -> list[str]:
        """One sentence a number; ``units`` are SI units by name."""
        return [one.sentence((units or {}).get(one.name, "1")) for one in self.verdicts]


def judge_samples(
    names: Sequence[str],
    values: ArrayLike,
    samples: ArrayLike,
    *,
    sizes: Mapping[str, float] | None = None,
    limits: Mapping[str, tuple[float, float]] | None = None,
    doubts: Mapping[str, Sequence[str]] | None = None,
    far: Mapping[str, float] | None = None,
) -> Assessment:
    """Judge numbers by draws of them: fits to resampled repeats, or a chain.

    A number is *determined* as `tarsus.fit.verdict` has it. Else it may be determined *together with another*: the
    product of both, one to a power, is that narrow, and three times narrower than the number itself (see
    `find_product`). A number whose sign the draws leave open is not determined, unless it has a size.

    Parameters
    ----------
    names, values
        Of the numbers, SI (np,).
    samples
        Draws (ns, np); rows with NaN are left out.
    sizes
        By name, for numbers that may be of either sign: what a change is compared with instead of the number itself.
    limits
        By name, where the search for a number ended: an end of a range that lies there is open.
    doubts
        By name, what speaks against the model that a number rests on, in words: such a number is not determined.
    far
        By name, by how much a number may be wrong because of that.

    Raises
    ------
    InputError
        If names, values and samples do not fit each other, a value is not finite, a size is not positive or of no
        number, or fewer than 20 draws are finite.
    """
    drawn = _Draws.of(tuple(names), values, samples, sizes or {})
    ends = limits or {}
    related = correlation(np.where(np.isfinite(drawn.u).all(axis=0), drawn.u, drawn.rows))
    verdicts: list[NumberVerdict] = []
    for j, name in enumerate(drawn.names):
        size = None if np.isnan(drawn.sizes[j]) else float(drawn.sizes[j])
        one = range_of(drawn.rows[:, j], value=drawn.values[j], limits=ends.get(name, (-np.inf, np.inf)), name=name)
        cut = not np.isfinite(one.low), not np.isfinite(one.high)
        against = tuple((doubts or {}).get(name, ()))
        one = replace(one, verdict=verdict_of((one.low, one.high), cut, size=size, doubted=bool(against)))
        tie = None
        if one.verdict is Verdict.UNDECIDED and drawn.usable[j]:
            tie = _found(drawn, j)
        strongest: tuple[tuple[str, float], ...] = ()
        if one.verdict is Verdict.UNDECIDED and tie is None:
            order = np.argsort(-np.abs(np.nan_to_num(related[j])))
            close = [k for k in order if k != j and abs(related[j, k]) >= _RELATED]
            strongest = tuple((drawn.names[k], float(related[j, k])) for k in close[:3])
        verdicts.append(NumberVerdict(name, one, tie, strongest, against, (far or {}).get(name, np.nan)))
    return Assessment(drawn.names, related, tuple(verdicts), f"{len(drawn.rows)} draws")


@dataclass(frozen=True)
class _Draws:
    """Finite draws: names; values (np,), rows (ns, np) [SI]; sizes (np,): NaN for a number that is its own; u (ns, np):
    pure numbers, logarithms over the value (NaN for another sign) or parts of the size; usable (np,): those that a
    product may hold."""

    names: tuple[str, ...]
    values: Floats
    rows: Floats
    sizes: Floats
    u: Floats
    usable: NDArray[np.bool_]

    @classmethod
    def of(cls, names: tuple[str, ...], values: ArrayLike, samples: ArrayLike, sizes: Mapping[str, float]) -> _Draws:
        rows, numbers = np.asarray(samples, dtype=float), np.asarray(values, dtype=float)
        if rows.ndim != 2 or rows.shape[1] != len(names) or numbers.shape != (len(names),):
            raise InputError(
                f"expected {len(names)} values and samples of shape (draws, {len(names)}), got {numbers.shape} and "
                f"{rows.shape}"
            )
        problems = [f"sizes: '{name}' is none of the parameters" for name in sizes if name not in names]
        problems += [f"{name}: expected a size above 0, got {s:g}" for name, s in sizes.items() if not s > 0.0]
        wrong = zip(names, numbers, strict=True)
        problems += [f"{name}: expected a finite value, got {v}" for name, v in wrong if not np.isfinite(v)]
        if problems:
            raise InputError(problems)
        rows = rows[np.isfinite(rows).all(axis=1)]
        # a number found to be zero is compared with its largest draw, so that it does not count as determined
        largest = np.abs(rows).max(axis=0, initial=0.0)
        own = np.where(numbers == 0.0, np.where(largest > 0.0, largest, 1.0), np.nan)
        scale = np.array([sizes.get(name, size) for name, size in zip(names, own, strict=True)])
        plain = np.isnan(scale)
        with np.errstate(divide="ignore", invalid="ignore"):
            u = np.where(plain, np.log(rows / numbers), (rows - numbers) / scale)
        usable = plain & np.isfinite(u).all(axis=0) & (np.ptp(rows, axis=0) > 0.0)
        return cls(names, numbers, rows, scale, u, usable)


def _found(drawn: _Draws, j: int) -> Combination | None:
    """The product with another number that draws hold fixed with number j."""
    others = [int(k) for k in np.flatnonzero(drawn.usable) if k != j]
    pair = find_product(drawn.u, j, others)
    if pair is None:
        return None
    first, second, power = pair
    value = float(abs(drawn.values[first]) * abs(drawn.values[second]) ** power)
    interval = range_of(value * np.exp(drawn.u[:, first] + power * drawn.u[:, second]), value=value)
    return Combination((drawn.names[first], drawn.names[second]), power, interval)


def _free(one: Range, unit: str) -> str:
    """What a range leaves open, after "they leave it"."""
    text = one.text(unit)
    if text == "anything":
        return "free to be anything"
    if not one.closed:
        return f"anything {text}"
    return f"at {text}" if one.pieces else f"anywhere from {text}"
