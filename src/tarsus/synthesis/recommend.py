"""The verb `tarsus.recommend`: what to record next, and what it cannot determine."""

from __future__ import annotations

import os
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from math import exp, inf, log
from pathlib import Path
from typing import Any

from tarsus.base.arguments import Values
from tarsus.base.errors import InputError
from tarsus.base.messages import nearest
from tarsus.base.progress import Progress
from tarsus.base.spec import get_value
from tarsus.base.threads import single_threaded
from tarsus.base.units import parse_quantity
from tarsus.base.verb import verb
from tarsus.base.workers import Workers
from tarsus.files.draws import read_draws
from tarsus.files.library import SceneLike, as_scene
from tarsus.fit.verdict import Verdict, verdict_of
from tarsus.model.scene import Scene
from tarsus.synthesis.belief import Belief
from tarsus.synthesis.information import Sensing
from tarsus.synthesis.proposals import UNITS, proposals
from tarsus.synthesis.ranking import Ranking, rank
from tarsus.tables.numbers import amount, percent
from tarsus.tables.table import Column, Table, Tabled

SHOWN = 12
"""Records that the table names; the plain data hold all."""
NEAR = 1.5
"""Factor of a 95 % interval below which it is said in percent: beyond, both sides of it differ by more than a half."""
NOTHING = 10.0
"""Factor of a 95 % interval from which on no more is said: not even the order of magnitude is known."""


@dataclass(frozen=True, repr=False)
class Recommendation(Tabled):
    """Records by what each would tell of one number, or of all, and those chosen within the budget."""

    scene: Scene
    ranking: Ranking

    @property
    def says(self) -> dict[str, Verdict]:
        """What the plan's records will say of each number at best; *assumed* where they tell nothing of it."""
        found = self.ranking
        return {
            path: verdict_of((exp(-1.96 * after), exp(1.96 * after)), of_prior=after / before)
            for path, before, after in zip(found.paths, found.before, found.after, strict=True)
        }

    def table(self) -> Table:
        """What is known, the best records, the plan, and what it leaves of every number."""
        found = self.ranking
        best, what = found.ranked[:SHOWN], "intervals narrower by"
        title = f"not known exactly: {', '.join(found.paths)}"
        if found.parameter is not None:
            what, value = ("known after it within", amount(get_value(self.scene, found.parameter), found.unit, 5))
            others = ", ".join(path for path in found.paths if path != found.parameter)
            title = (
                f"{found.parameter} = {value}, known within {self._after(0.0)} (95 %)\n"
                f"not known either: {others or 'nothing'}"
            )
        noted = any(one.note for one in best)
        rows = [
            (
                one.recording.name,
                one.recording.duration,
                self._after(one.gain),
                one.repeats or None,
                *((one.note,) if noted else ()),
            )
            for one in best
        ]
        more = len(found.ranked) - len(best)
        return Table(
            title,
            ("record", Column("time", "s", 3), what, "times in the plan", *(("note",) if noted else ())),
            rows,
            [f"and {more} records that determine less"] if more else [],
            [self._plan(), self._numbers()],
        )

    def _after(self, gain: float) -> str:
        """What a gain leaves: of the number in question, or of all as a factor."""
        std = self.ranking.std
        return f"a factor of {exp(gain):.3g}" if std is None else _within(std * exp(-gain))

    def _plan(self) -> Table:
        found, plan = self.ranking, self.ranking.plan
        if not plan.steps:
            what = found.parameter or "the numbers"
            none = f"No record within {amount(found.budget, 's', 3)} determines {what} well enough to be worth taking."
            return Table(none, (), ())
        left = self._after(plan.gain)
        expected = f"known within {left} (95 %)" if found.parameter else f"intervals narrower by {left} in the mean"
        counts = Counter(recording.name for recording, _ in plan.steps)
        title = f"Record, in {amount(plan.cost, 's', 3)} of {amount(found.budget, 's', 3)}:"
        return Table(title, ("record", "times"), list(counts.items()), [f"Expected: {expected}."])

    def _numbers(self) -> Table:
        """Every number: what is known of it, and what these records can tell at best."""
        found, says = self.ranking, self.says
        lacking = [path for path, word in says.items() if word is Verdict.ASSUMED]
        rows = [
            (path, _within(before), _within(bound), "" if path in lacking else says[path].value)
            for path, before, bound in zip(found.paths, found.before, found.bounds, strict=True)
        ]
        of = "these records" if found.plan.steps else f"'{found.ranked[0].recording.name}'"
        notes = ["Lower bounds: no estimate is closer, and a model or an instrument that is wrong not as close."]
        notes += [f"Not from {of}: {', '.join(lacking)}."] if lacking else []
        columns = ("number", "known now within", "lower bound from these alone", "at best")
        return Table(f"What {of} can determine (95 %):", columns, rows, notes)

    def to_dict(self) -> dict[str, Any]:
        """Plain data of all records; standard deviations are those of natural logarithms."""
        found, says = self.ranking, self.says
        std = found.std
        records = [
            {
                "name": one.recording.name,
                **_driven(one.recording),
                "gap_m": one.recording.gap,
                "record_s": one.recording.duration,
                "std": None if std is None else std * exp(-one.gain),
                "gain": one.gain,
                "records": one.repeats,
                "note": one.note,
                "bounds": dict(zip(found.paths, map(_finite, one.bounds), strict=True)),
            }
            for one in found.ranked
        ]
        plan = {
            "records": [{"name": recording.name, "gain": gain} for recording, gain in found.plan.steps],
            "cost_s": found.plan.cost,
            "std": None if std is None else std * exp(-found.plan.gain),
            "gain": found.plan.gain,
        }
        numbers = [
            {"path": path, "std": was, "bound": _finite(bound), "std_after": after, "says": says[path].value}
            for path, was, bound, after in zip(found.paths, found.before, found.bounds, found.after, strict=True)
        ]
        return {
            "parameter": found.parameter,
            "unknown": list(found.paths),
            "std": std,
            "budget_s": found.budget,
            "records": records,
            "plan": plan,
            "numbers": numbers,
        }

    __repr__ = Tabled.__str__


def _driven(recording: Any) -> dict[str, Any]:
    """What drives a record: one signal, a gait, or signals of some drives."""
    return {
        "signal": None if recording.signal is None else recording.signal.model_dump(),
        "gait": None if recording.gait is None else recording.gait.model_dump(),
        "signals": {drive: one.model_dump() for drive, one in recording.signals.items()},
    }


def _finite(std: float) -> float | None:
    """A standard deviation; none where not even the order of magnitude is known."""
    return std if 1.96 * std < log(NOTHING) else None


def _within(std: float) -> str:
    """The 95 % interval of a number whose logarithm has that standard deviation, to either side."""
    factor = exp(1.96 * std) if std < 100.0 else inf
    if factor >= NOTHING:
        return "not at all"
    return percent(factor - 1.0) if factor < NEAR else f"a factor of {factor:.3g}"


@single_threaded
@verb
def recommend(
    device: SceneLike,
    *,
    parameter: str | None = None,
    budget: float | str,
    vary: Values | None = None,
    unknown: Sequence[str] = (),
    spread: float | str = "30 %",
    draws: str | os.PathLike[str] | None = None,
    sensing: Sensing | None = None,
    seed: int = 0,
    threads: Workers = None,
    progress: Progress | None = None,
) -> Recommendation:
    """Rank records by what each would show of one number, or about all, and choose some for a budget.

    Of a device they are ramped squares, a sweep and slow loops, of a walker its gait and single legs.

    Parameters
    ----------
    device
        A device, a scene file or a scene. After an identification it is identified.toml.
    parameter
        Path of the number in question, such as ``ground.adhesion.rate``; all that are not known where left out.
    budget
        Time of recording [s].
    vary
        What the candidates differ in, every combination: ``hz``, ``volts``, ``ramp`` (lambda, the share of half a
        period that each ramp of the ramped square takes), ``gap``, with its values, such as "5, 15, 50". About the
        device's own signal where left out, and never stronger. Of a walker ``hz`` and ``volts``, of its gait.
    unknown
        Paths of further numbers that are not known exactly; those that a campaign identifies are.
    spread
        Standard deviation of what has no interval, as a share of it.
    draws
        File of draws of `identify`; draws.npz next to a scene file when left out.
    sensing
        The instruments; by default a vibrometer at 20 kHz, and of a walker a bridge behind its drives.
    seed
        Of the draws.
    threads
        Worker threads, or an executor.
    progress
        Called as ``progress(done, total, what)``.

    Returns
    -------
    Recommendation
        The ranking, the plan within the budget, and lower bounds of every number.

    Raises
    ------
    InputError
        For a parameter that the scene lacks, quantities that cannot be read, and as `tarsus.synthesis.ranking.rank`.
    """
    scene = as_scene(device)
    seconds, share, grid = _quantities(budget, spread, vary or {})
    file = draws_next_to(device) if draws is None and not isinstance(device, Scene) else draws
    read = None if file is None else read_draws(Path(file))
    belief = Belief.of(scene, [*([parameter] if parameter else []), *unknown], share, read)
    tool = sensing or Sensing()
    found = rank(
        scene,
        proposals(scene, grid, tool.rate),
        belief,
        parameter,
        seconds,
        sensing=tool,
        seed=seed,
        threads=threads,
        progress=progress,
    )
    return Recommendation(scene, found)


def draws_next_to(device: str | os.PathLike[str]) -> Path | None:
    """The draws that `identify` wrote next to a scene file, where there are any."""
    file = Path(device).with_name("draws.npz")
    return file if os.fspath(device).endswith(".toml") and file.exists() else None


def _quantities(budget: float | str, spread: float | str, vary: Values) -> tuple[float, float, dict[str, list[float]]]:
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
            problems.append(f"vary: candidates differ in {', '.join(UNITS)}, not in '{name}'{nearest(name, UNITS)}")
            continue
        listed = values.split(",") if isinstance(values, str) else values
        each = listed if isinstance(listed, Sequence) else [] if listed is None else [listed]
        found[name] = [read(name, one.strip() if isinstance(one, str) else one, UNITS[name]) for one in each]
    seconds, share = read("budget", budget, "s"), read("spread", spread, "1")
    if share <= 0.0:
        problems.append(f"spread: expected a share above 0, got {spread}")
    if problems:
        raise InputError(problems)
    return seconds, share, found
