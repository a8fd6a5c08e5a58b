"""The verb `tarsus.recommend`: which drive signals to record next, for one parameter and a budget of time."""

from __future__ import annotations

import os
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from math import exp
from pathlib import Path
from typing import Any

from tarsus.base.errors import InputError
from tarsus.base.messages import nearest
from tarsus.base.spec import float_paths
from tarsus.base.threads import single_threaded
from tarsus.base.units import parse_quantity
from tarsus.base.workers import Workers
from tarsus.files.draws import read_draws
from tarsus.files.library import SceneLike, as_scene
from tarsus.identify.candidates import grid_about
from tarsus.identify.prior import LogNormalPrior, unknown_paths
from tarsus.identify.ranking import Ranking, rank
from tarsus.model.scene import Scene
from tarsus.tables.numbers import amount
from tarsus.tables.table import Column, Table

Values = str | float | Sequence[float | str]
"""One number or several: SI, or texts with units, in one text with commas between them."""

UNITS = {"hz": "Hz", "volts": "V", "ramp": "1", "gap": "m"}
"""What candidates may differ in, with units."""

SHOWN = 12
"""Signals that the table names; the plain data hold all."""

NEAR = 1.5
"""Factor of a 95 % interval below which it is said in percent: beyond, both sides of it differ by more than a half."""


@dataclass(frozen=True, repr=False)
class Recommendation:
    """Signals by what a record of each would tell about a parameter, and those chosen within the budget."""

    scene: Scene
    unknown: tuple[str, ...]
    ranking: Ranking

    def table(self) -> Table:
        """What is known, the best signals, and the plan."""
        found = self.ranking
        info = float_paths(self.scene)[found.parameter]
        others = ", ".join(path for path in self.unknown if path != found.parameter)
        known = f"{found.parameter} = {amount(info.value, info.unit, 5)}, known within {_within(found.std)} (95 %)"
        best = found.ranked[:SHOWN]
        rows = [
            (one.candidate.name, one.candidate.record, _within(one.std), one.repeats or None, one.note)
            for one in best
        ]
        more = len(found.ranked) - len(best)
        return Table(
            f"{known}\nnot known either: {others or 'nothing'}",
            ("signal", Column("record", "s", 3), "known after it within", "in the plan", "note"),
            rows,
            [f"and {more} signals that tell less"] if more else [],
            [self._plan()],
        )

    def _plan(self) -> Table:
        found, plan = self.ranking, self.ranking.plan
        if not plan.steps:
            return Table(
                f"No record within {found.budget:g} s tells enough about {found.parameter} to be worth taking.",
                (),
                (),
            )
        return Table(
            f"Record, in {plan.cost:.3g} s of {found.budget:g} s:",
            ("signal", "times"),
            list(Counter(candidate.name for candidate, _ in plan.steps).items()),
            [f"Expected: known within {_within(plan.std)} (95 %)."],
        )

    def to_dict(self) -> dict[str, Any]:
        """Plain data of all signals; std is that of the natural logarithm."""
        found = self.ranking
        return {
            "parameter": found.parameter,
            "unknown": list(self.unknown),
            "std": found.std,
            "budget_s": found.budget,
            "signals": [
                {
                    "name": one.candidate.name,
                    "signal": one.candidate.signal.model_dump(),
                    "gap_m": one.candidate.gap,
                    "record_s": one.candidate.record,
                    "std": one.std,
                    "gain": one.gain,
                    "records": one.repeats,
                    "note": one.note,
                }
                for one in found.ranked
            ],
            "plan": {
                "records": [{"name": candidate.name, "std": std} for candidate, std in found.plan.steps],
                "cost_s": found.plan.cost,
                "std": found.plan.std,
            },
        }

    def __str__(self) -> str:
        return self.table().text()

    __repr__ = __str__

    def _repr_html_(self) -> str:
        return self.table().html()


def _within(std: float) -> str:
    """The 95 % interval of a number whose logarithm has that standard deviation, to either side."""
    factor = exp(1.96 * std)
    return f"{100.0 * (factor - 1.0):.3g} %" if factor < NEAR else f"a factor of {factor:.3g}"


@single_threaded
def recommend(
    device: SceneLike,
    *,
    parameter: str,
    budget: float | str,
    vary: Mapping[str, Values] | None = None,
    unknown: Sequence[str] = (),
    spread: float | str = "30 %",
    draws: str | os.PathLike[str] | None = None,
    seed: int = 0,
    threads: Workers = None,
    progress: Callable[[int, int, str], None] | None = None,
) -> Recommendation:
    """Rank drive signals by what a record of each would tell about one parameter, and choose some for a budget.

    Parameters
    ----------
    device
        A device, a scene file, such as identified.toml, or a scene.
    parameter
        Path of the number in question, such as ``ground.adhesion.rate``.
    budget
        Time of recording [s].
    vary
        What the candidates differ in, every combination: ``hz``, ``volts``, ``ramp`` (lambda, the share of half a
        period that each ramp of the ramped square takes), ``gap``, as ``{"hz": "5, 15, 50"}``. About the device's own
        signal where left out, and never stronger.
    unknown
        Paths of further numbers that are not known exactly; those of the laws of the ground are.
    spread
        Standard deviation of what has no interval, as a share of it.
    draws
        File of draws of `identify`; draws.npz beside a scene file when left out.
    seed
        Of the draws.
    threads
        Worker threads, or an executor.
    progress
        Called as ``progress(done, total, what)``.

    Returns
    -------
    Recommendation
        The ranking, and the plan within the budget.

    Raises
    ------
    InputError
        For a parameter that the scene lacks, quantities that cannot be read, and as `tarsus.identify.ranking.rank`.
    """
    scene = as_scene(device)
    seconds, share, grid = _quantities(budget, spread, vary or {})
    paths = unknown_paths(scene, [parameter, *unknown])
    file = draws_beside(device) if draws is None and not isinstance(device, Scene) else draws
    prior = LogNormalPrior.of_scene(scene, paths, share, None if file is None else read_draws(Path(file)))
    candidates = grid_about(scene, *(grid.get(name) for name in UNITS))
    found = rank(scene, candidates, prior, parameter, seconds, seed=seed, threads=threads, progress=progress)
    return Recommendation(scene, paths, found)


def draws_beside(device: str | os.PathLike[str]) -> Path | None:
    """The draws that `identify` wrote beside a scene file, where there are any."""
    file = Path(device).with_name("draws.npz")
    return file if os.fspath(device).endswith(".toml") and file.exists() else None


def _quantities(
    budget: float | str, spread: float | str, vary: Mapping[str, Values]
) -> tuple[float, float, dict[str, list[float]]]:
    """Budget [s], share, and values [SI] of what is varied; with everything that is wrong."""
    problems: list[str] = []

    def read(name: str, value: float | str, unit: str) -> float:
        try:
            return parse_quantity(value, unit)
        except InputError as error:
            problems.extend(f"{name}: {one}" for one in error.problems)
            return float("nan")

    found: dict[str, list[float]] = {}
    for name, values in vary.items():
        if name not in UNITS:
            problems.append(
                f"vary: candidates differ in {', '.join(UNITS)}, not in '{name}'{nearest(name, UNITS)}"
            )
            continue
        listed = values.split(",") if isinstance(values, str) else values
        each = listed if isinstance(listed, Sequence) else [listed]
        found[name] = [read(name, one.strip() if isinstance(one, str) else one, UNITS[name]) for one in each]
    out = read("budget", budget, "s"), read("spread", spread, "1"), found
    if problems:
        raise InputError(problems)
    return out
