"""Is it determined, and what to measure next: the adhesion of a cantilever from the features of its records.

    python examples/next_measurement.py

The pull-off force of the law is C_a0 + C_a t after a contact of t seconds. One signal, however often repeated, has one
contact time: its records fix the force at that age, a weighted sum, and neither C_a0 nor C_a. The ranking then asks for
contacts of another length; a record of these tells C_a, a second one of the first signal does not. No records of such a
device exist, so they are made here: the truth is known, and noise is that of the instrument.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

import tarsus as ts
from tarsus.identify.candidates import Candidate, candidate_grid
from tarsus.identify.features import Features, Resolution, features_of, simulated
from tarsus.identify.prior import LogNormalPrior
from tarsus.identify.ranking import Ranking, rank
from tarsus.identify.verdict import Assessment, judge_samples

START, RATE = "ground.adhesion.initial", "ground.adhesion.rate"
UNITS = {START: "N", RATE: "N/s"}
TRUTH = {START: 170e-9, RATE: 2.8e-6}
KINDS = ("contact_duration", "peak")
INSTRUMENT = Resolution(share=0.015)


def device() -> ts.Scene:
    """The packaged cantilever, with a guess of its adhesion."""
    return ts.load_scene("cantilever-capture", **{START: "150 nN", RATE: "3.4 uN/s"})


def recorded(candidate: Candidate, seed: int) -> tuple[Candidate, Features]:
    """Features of a record of the true device, as the instrument would give them."""
    scene = candidate.on(device())
    true = features_of(ts.simulate(ts.with_values(scene, TRUTH), candidate.record), KINDS)
    noise = true.error(INSTRUMENT) * np.random.default_rng(seed).standard_normal(len(KINDS))
    return candidate, Features(true.names, true.units, true.values + noise, true.spread, true.periods)


def learnt(
    records: list[tuple[Candidate, Features]],
    prior: LogNormalPrior,
    near: LogNormalPrior | None = None,
    draws: int = 1024,
) -> np.ndarray:
    """Draws (draws, 2) of what records leave of a prior: devices are drawn from it, or from where they are expected,
    and drawn again by how well they give the features."""
    logs = (near or prior).draws(draws)
    devices = (near or prior).values * np.exp(logs)
    log = _log_density(prior, devices) - _log_density(near or prior, devices)
    for candidate, seen in records:
        vary = dict(zip(prior.paths, devices.T, strict=True))
        found = simulated(candidate.on(device()), vary, candidate.record, KINDS)
        variance = seen.error(INSTRUMENT) ** 2 + found.spread**2 / found.periods
        terms = (found.values - seen.values) ** 2 / variance + np.log(variance)
        log -= 0.5 * np.nan_to_num(terms, nan=np.inf).sum(axis=1)
    share = np.cumsum(np.exp(log - log.max()))
    places = (np.arange(draws) + np.random.default_rng(0).random(draws)) / draws * share[-1]
    return devices[np.searchsorted(share, places)]


def _log_density(known: LogNormalPrior, devices: np.ndarray) -> np.ndarray:
    off = np.log(devices / known.values)
    return -0.5 * np.einsum("ni,ij,nj->n", off, np.linalg.inv(known.covariance), off)


@dataclass(frozen=True)
class Story:
    """What was known after the first record, what the ranking said, and what was known after what it asked for."""

    first: Assessment
    ranking: Ranking
    second: Assessment
    instead: Assessment


def measured(draws: int = 1024) -> Story:
    """One record at 15 Hz; then the signal on top of the ranking for C_a; and, instead, the first one once more."""
    grid = candidate_grid((5.0, 15.0, 100.0), (6.0, 8.0), (0.25,))
    begin = next(c for c in grid if c.name.startswith("15 Hz, 6 V"))
    prior = LogNormalPrior.of_scene(device(), (START, RATE), spread=0.5)
    record = recorded(begin, 1)
    first = learnt([record], prior, draws=draws)
    near = LogNormalPrior.of_samples(prior.paths, first)
    ranking = rank(device(), grid, near, RATE, budget=2.0, kinds=KINDS, instrument=INSTRUMENT)
    asked, again = recorded(ranking.ranked[0].candidate, 2), recorded(begin, 2)
    second, instead = (learnt([record, other], prior, near, draws) for other in (asked, again))
    judged = [judge_samples(prior.paths, np.median(rows, axis=0), rows) for rows in (first, second, instead)]
    return Story(judged[0], ranking, judged[1], judged[2])


def text(story: Story) -> str:
    """The story for people."""
    top = story.ranking.ranked[0]
    lines = ["After one record at 15 Hz:", *story.first.sentences(UNITS), ""]
    lines += [f"Signals by what they tell of {RATE}:"]
    lines += [
        f"  {one.candidate.name:24s} expected standard deviation {one.std:.0%}"
        for one in story.ranking.ranked
    ]
    lines += ["", f"After a record at {top.candidate.name}:", *story.second.sentences(UNITS)]
    lines += ["", "After a second record at 15 Hz instead:", *story.instead.sentences(UNITS)]
    lines += [
        "",
        f"The truth: {', '.join(f'{path} = {value:.3g} {UNITS[path]}' for path, value in TRUTH.items())}",
    ]
    return "\n".join(lines)


if __name__ == "__main__":
    print(text(measured()))
