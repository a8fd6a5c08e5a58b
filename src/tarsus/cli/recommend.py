"""`tarsus recommend`: what to record next, for one number or for all, and a budget of time."""

from __future__ import annotations

from typing import Annotated

from cyclopts import Parameter

from tarsus.cli.options import HERE, UNCHANGED, Changes, Json, Many, Seed, Work


def recommend(
    device: str,
    /,
    *,
    parameter: str | None = None,
    budget: Annotated[str, Parameter(allow_leading_hyphen=True)],
    vary: Many = None,
    unknown: Many = None,
    spread: Annotated[str, Parameter(allow_leading_hyphen=True)] = "30 %",
    seed: Seed = 0,
    changes: Changes = UNCHANGED,
    work: Work = HERE,
    json: Json = False,
) -> int:
    """Rank records by what each would tell about one number, or about all, and choose some for a budget.

    Of a device they are ramped squares, a sweep and slow loops, of a walker its gait and single legs. It is said in
    advance how closely each number can be known after them at best, and which cannot be told.

    Parameters
    ----------
    device
        a device (see `tarsus devices`) or a scene file, such as identified.toml; draws.npz beside it is used.
    parameter
        path of the number in question, e.g. ground.adhesion.rate; all that a campaign identifies when left out.
    budget
        time of recording, e.g. "2 s".
    vary
        what the candidates differ in: hz="5, 15, 50", volts="4, 6, 8", gap="70 um, 90 um", or ramp="0, 0.25" (lambda,
        the share of half a period that each ramp of the ramped square takes); about the device's own signal when left
        out. Of a walker hz and volts, of its gait. May be repeated.
    unknown
        path of a further number that is not known exactly; those that a campaign identifies are. May be repeated.
    spread
        standard deviation of what has no interval, as a share of it.
    """
    import tarsus
    from tarsus.cli import console, requests
    from tarsus.synthesis.recommend import draws_beside

    with console.progress_bar("records", time_left=True) as progress, work.workers() as workers:
        found = tarsus.recommend(
            changes.scene(device), parameter=parameter, budget=budget, vary=requests.texts_of(vary or (), "--vary"),
            unknown=unknown or (), spread=spread, draws=draws_beside(device), seed=seed, threads=workers,
            progress=progress,
        )  # fmt: skip
    return console.show(found, json)
