"""`tarsus recommend`: which drive signals to record next, for one parameter and a budget of time."""

from __future__ import annotations

from typing import Annotated

from cyclopts import Parameter

from tarsus.cli.options import HERE, UNCHANGED, Changes, Json, Many, Seed, Work


def recommend(
    device: str,
    /,
    *,
    parameter: str,
    budget: Annotated[str, Parameter(allow_leading_hyphen=True)],
    vary: Many = None,
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
    vary
        what the candidates differ in: hz="5, 15, 50", volts="4, 6, 8", gap="70 um, 90 um", or ramp="0, 0.25" (lambda,
        the share of half a period that each ramp of the ramped square takes); about the device's own signal when left
        out. May be repeated.
    unknown
        path of a further number that is not known exactly; those of the laws of the ground are. May be repeated.
    spread
        standard deviation of what has no interval, as a share of it.
    """
    import tarsus
    from tarsus.cli import console, requests
    from tarsus.identify.recommend import draws_beside

    with console.progress_bar("signals", time_left=True) as progress, work.workers() as workers:
        found = tarsus.recommend(
            changes.scene(device), parameter=parameter, budget=budget, vary=requests.texts_of(vary or (), "--vary"),
            unknown=unknown or (), spread=spread, draws=draws_beside(device), seed=seed, threads=workers,
            progress=progress,
        )  # fmt: skip
    return console.show(found, json)
