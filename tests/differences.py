"""Derivatives by differences of fourth order, which tests hold exact ones to."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

import tarsus as ts
from tarsus.base.spec import get_value, with_values

AROUND = (-2.0, -1.0, 1.0, 2.0)
"""Where the four values of a difference are, in steps."""


def slope(values: Sequence[Any], step: float) -> Any:
    """Derivative by the values, numbers or arrays alike, at `AROUND` times a step."""
    far, near, ahead, beyond = map(np.asarray, values)
    return (far - 8.0 * near + 8.0 * ahead - beyond) / (12.0 * step)


def runs_around(
    scene: ts.Scene, path: str, step: float, duration: float | None = None, accuracy: ts.Accuracy | None = None
) -> list[ts.Run]:
    """Runs of the scene with one of its numbers moved by `AROUND` times a step."""
    at = float(get_value(scene, path))
    return [ts.simulate(with_values(scene, {path: at + k * step}), duration, accuracy) for k in AROUND]


TIGHT = ts.Accuracy(gap=1e-11, drive=1e-11)
STEPS = (1e-5, 1e-4, 1e-3)
"""A difference errs by rounding of 1e-11 over its step and by the fourth power of it, more where motion is sensitive: a
derivative is right if it agrees with one of three."""
OWN = 1e-5
"""Step, relative to the number, of the derivatives that are tested."""
FIELDS = ("time", "speed_before", "speed_after", "pull", "energy")


def differences(
    scene: ts.Scene, path: str, duration: float, values: Callable[[ts.Run], list[Any]], steps: Sequence[float]
) -> dict[float, list[np.ndarray]]:
    """What ``values`` makes of tight runs, differentiated, by the steps [of the number] over which no event comes or
    goes."""
    at = abs(float(get_value(scene, path))) or 1.0
    out = {}
    for step in steps:
        runs = runs_around(scene, path, step * at, duration, TIGHT)
        if len({tuple(run.events["kind"]) for run in runs}) == 1:
            out[step] = [slope(four, step * at) for four in zip(*map(values, runs), strict=True)]
    return out


def assert_as_differences(
    scene: ts.Scene,
    paths: Sequence[str],
    duration: float,
    within: float,
    steps: Sequence[float] = STEPS,
    terms: Sequence[str] = (),
    fields: Sequence[str] = FIELDS,
) -> ts.Run:
    """Events, states, a walker's marks and terms (measures, and of the account) of a run differ along its derivatives,
    relative to the largest of each kind; the run."""
    run = ts.simulate(scene, duration, TIGHT, gradients=[*paths])
    times = np.linspace(0.0, duration, 9)[1:-1] * 0.997
    states, way = run.state_gradients(times), () if run.marks is None else ("body", "foot_x", "slipped")
    shown = ("x", "v") if run.marks is None else ("x", "v", "rate", "pull")
    names = (*fields, *shown, *way, *terms)

    def term(one: ts.Run, name: str) -> float:
        of, _, rest = name.partition("ledger.")
        return one.measures[of].value if of else one.ledger.laws.get(rest, getattr(one.ledger, rest, None))

    def numbers(one: ts.Run) -> list[Any]:
        at = one.states(times)
        found = [*(one.events[name] for name in fields), *(getattr(at, name) for name in shown)]
        return [*found, *(one.marks[name] for name in way), *(term(one, name) for name in terms)]

    for path in paths:
        assert path not in run.flags
        value = abs(float(get_value(scene, path))) or 1.0
        got = [*(run.event_gradients[path][name] for name in fields)]
        got += [getattr(states[path], name) for name in shown]
        got += [run.mark_gradients[path][name] for name in way] + [run.gradient(name)[path] for name in terms]
        found = differences(scene, path, duration, numbers, steps)
        assert found, path
        for k, (had, own) in enumerate(zip(got, numbers(run), strict=True)):
            errors = []
            for step, wanted in found.items():
                # numbers that runs know to 1e-11 of the largest resolve no slope below that, over the shorter step
                known = 1e-11 * np.abs(own).max(initial=0.0) / (min(step, OWN) * value) / within
                size = max(np.abs(wanted[k]).max(initial=0.0), known, 1e-12 / value)
                errors.append(np.abs(had - wanted[k]).max(initial=0.0) / size)
            assert min(errors) <= within, (path, names[k], errors)
    return run
