"""`tarsus recommend`: which drive signals to record next, for one parameter and a budget of time."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from cyclopts import Parameter

from tarsus.cli.options import HERE, UNCHANGED, Changes, Json, Many, Seed, Work

if TYPE_CHECKING:
    from tarsus.identify.ranking import Ranking
    from tarsus.model.scene import Scene

SHOWN = 12
"""Signals that the table names; --json gives all."""


def recommend(
    device: str,
    /,
    *,
    parameter: str,
    budget: Annotated[str, Parameter(allow_leading_hyphen=True)],
    hz: str | None = None,
    volts: str | None = None,
    ramp: str | None = None,
    gap: str | None = None,
    unknown: Many = None,
    spread: str = "30 %",
    seed: Seed = 0,
    changes: Changes = UNCHANGED,
    work: Work = HERE,
    json: Json = False,
) -> int:
    """Rank drive signals by what a record of each would tell about one parameter, and choose some for a budget.

    Parameters
    ----------
    device
        a device (see `tarsus devices`) or a scene file, such as identified.toml; draws.npz beside it is used.
    parameter
        path of the number in question, e.g. ground.adhesion.rate.
    budget
        time of recording, e.g. "2 s".
    hz
        frequencies of the candidates, e.g. "5, 15, 50"; 0.1 to 2 times the device's own when left out.
    volts
        amplitudes, e.g. "4, 6, 8"; a quarter to all of the device's own when left out.
    ramp
        lambda, the share of half a period that each ramp of the ramped square takes, e.g. "0, 0.25".
    gap
        clearances, e.g. "70 um, 90 um"; the device's own when left out.
    unknown
        path of a further number that is not known exactly; those of the laws of the ground are. May be repeated.
    spread
        standard deviation of what has no interval, as a share of it.
    """
    from tarsus.cli import console, requests
    from tarsus.files.draws import read_draws
    from tarsus.identify.candidates import grid_about
    from tarsus.identify.prior import LogNormalPrior, unknown_paths
    from tarsus.identify.ranking import rank

    scene = changes.scene(device)
    lists = requests.quantity_lists_of(
        ("budget", "spread"),
        hz=(hz, "Hz"),
        volts=(volts, "V"),
        ramp=(ramp, "1"),
        gap=(gap, "m"),
        budget=(budget, "s"),
        spread=(spread, "1"),
    )
    (seconds,), (share,) = lists.pop("budget"), lists.pop("spread")
    paths = unknown_paths(scene, [parameter, *(unknown or ())])
    beside = Path(device).parent / "draws.npz"
    draws = read_draws(beside) if device.endswith(".toml") and beside.exists() else None
    prior = LogNormalPrior.of_scene(scene, paths, share, draws)
    grid = grid_about(scene, *(lists.get(name) for name in ("hz", "volts", "ramp", "gap")))
    with console.progress_bar("signals", time_left=True) as progress, work.workers() as workers:
        found = rank(scene, grid, prior, parameter, seconds, seed=seed, threads=workers, progress=progress)
    if json:
        console.print_json(_object(found, paths))
    else:
        _print(found, scene, paths)
    return 0


def _known(std: float) -> str:
    """The 95 % interval of a number whose logarithm has that standard deviation, to either side."""
    from math import exp

    factor = exp(1.96 * std)
    return f"{100.0 * (factor - 1.0):.3g} %" if factor < 1.5 else f"a factor of {factor:.3g}"


def _print(found: Ranking, scene: Scene, paths: tuple[str, ...]) -> None:
    from tarsus.base.spec import float_paths
    from tarsus.base.units import format_quantity
    from tarsus.cli import console

    info = float_paths(scene)[found.parameter]
    others = [path for path in paths if path != found.parameter]
    print(
        f"{found.parameter} = {format_quantity(float(f'{info.value:.5g}'), info.unit)}, known within "
        f"{_known(found.std)} (95 %)"
    )
    print(f"not known either: {', '.join(others) if others else 'nothing'}\n")
    best = found.ranked[:SHOWN]
    rows = [
        (
            one.candidate.name,
            f"{one.candidate.record:.3g} s",
            _known(one.std),
            str(one.repeats or "-"),
            one.note or "-",
        )
        for one in best
    ]
    console.table(("signal", "record", "known after it within", "in the plan", "note"), rows)
    if len(found.ranked) > len(best):
        print(f"and {len(found.ranked) - len(best)} signals that tell less")
    if not found.plan.steps:
        print(
            f"\nNo record within {found.budget:g} s tells enough about {found.parameter} to be worth taking."
        )
        return
    times: dict[str, int] = {}
    for candidate, _ in found.plan.steps:
        times[candidate.name] = times.get(candidate.name, 0) + 1
    print(f"\nRecord, in {found.plan.cost:.3g} s of {found.budget:g} s:")
    for name, count in times.items():
        print(f"  {name}" + (f", {count} times" if count > 1 else ""))
    print(f"Expected: known within {_known(found.plan.std)} (95 %).")


def _object(found: Ranking, paths: tuple[str, ...]) -> dict[str, Any]:
    """Plain data; std is that of the natural logarithm."""
    return {
        "parameter": found.parameter,
        "unknown": list(paths),
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
