"""Headers in C for a microcontroller: the gait of a walker, or the volts of every drive over a period."""

from __future__ import annotations

import numpy as np

from tarsus.base.errors import InputError
from tarsus.design.headers import drives_header_text, gait_header_text, in_ticks
from tarsus.export.subject import Subject, knots
from tarsus.export.verb import Exported
from tarsus.model.drive.laws import LinearForce
from tarsus.model.drive.lower import lower
from tarsus.model.drive.pieces import Pieces, evaluate
from tarsus.model.drive.waveforms import Constant

TICK = 1e-6
"""Of the timer [s], unless another is asked for."""

SAMPLES = 256
"""Values in a period of volts that are not constant between edges: a sine is held within 1.2 % of its amplitude."""


def exported(described: Subject, step: float | None) -> Exported:
    """``gait.h`` of a scene whose drives follow a gait alone, else ``drives.h``; step [s]: a tick of the timer.

    Raises InputError as the headers do, and for drives without a common period.
    """
    scene, tick = described.scene, TICK if step is None else step
    lost = ["everything but the volts that are commanded: robot and ground are not in the tables"]
    if scene.gait is not None and not scene.signals:
        return Exported.listed({"gait.h": gait_header_text(scene, tick=tick)}, lost)
    period = _period(described)
    count = in_ticks(period, tick)
    commands = {name: scene.waveforms.get(name) or Constant(level=0.0) for name in described.drives}
    unit, tables = LinearForce(gain=1.0), {}
    for name, command in commands.items():
        _, volts = lower(command, unit, ())
        tables[name] = _table(volts, period, count)
        edges, levels = tables[name]
        if not np.allclose(evaluate(volts, (np.append(edges[1:], count) - 0.5) * period / count), levels, atol=5e-4):
            lost.append(f"{name}: its volts change all the time, and are held between {len(edges)} values a period")
    files = {"drives.h": drives_header_text(scene.name, tables, count, period / count)}
    return Exported.listed(files, lost)


def _period(described: Subject) -> float:
    """The period of all drives [s]: the longest, of which the others' are whole parts; of drives that do not repeat the
    run's length."""
    waves = described.scene.waveforms.values()
    periods = [wave.period for wave in waves if not isinstance(wave, Constant)]
    if not periods or None in periods:
        return described.run.duration
    own = [one for one in periods if one is not None]
    turns = max(own) / np.array(own)
    if np.abs(turns - np.rint(turns)).max() > 1e-9:
        raise InputError(
            f"c: the drives' periods ({', '.join(f'{one:.6g} s' for one in own)}) have no common one: "
            "give signals of one frequency"
        )
    return max(own)


def _table(volts: Pieces, period: float, count: int) -> tuple[list[int], list[float]]:
    """Ticks at which volts change, the first 0, and the volts from each on: the value in the middle of each stretch."""
    times = knots([volts], period)
    middles = 0.5 * (times[1:] + times[:-1])
    thirds = times[:-1] + np.diff(times) / 3.0
    bends = np.abs(evaluate(volts, thirds) - evaluate(volts, middles)) > 5e-4  # half a millivolt
    edges = [times[:-1]]
    even = np.linspace(0.0, period, SAMPLES, endpoint=False)
    inside = np.searchsorted(times, even, side="right") - 1
    edges.append(even[bends[np.clip(inside, 0, len(bends) - 1)]])
    ticks = np.unique(np.rint(np.concatenate(edges) / period * count).astype(int))
    ticks = ticks[ticks < count]
    levels = evaluate(volts, 0.5 * (ticks + np.append(ticks[1:], count)) * period / count)
    keep = np.concatenate([[True], np.rint(1e3 * levels[1:]) != np.rint(1e3 * levels[:-1])])
    return ticks[keep].tolist(), levels[keep].tolist()
