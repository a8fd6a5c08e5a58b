"""Walks of a campaign: the gait of a walker at several paces, and exercises of single legs while the others stand."""

from __future__ import annotations

from tarsus.base.errors import InputError
from tarsus.model.drive.gait import AnyGait, Layout
from tarsus.model.drive.waveforms import Square
from tarsus.model.scene import Scene
from tarsus.records.excluded import evenly
from tarsus.records.purpose import Purpose
from tarsus.synthesis.recordings import REPEATS, Recording

PACES = (1.0, 0.6)
"""Frequencies of the walks, in that of the device's gait: the film acts by the speed, adhesion by the time on the
ground."""
PERIODS = 10
"""Periods of each walk and exercise: with three repeats 30 landings of every leg."""
MOST_LEGS = 6
"""Legs that are exercised alone, evenly among all; each takes a record."""


def planned_walks(scene: Scene) -> list[Recording]:
    """The walks of a campaign on a walker: its gait, or its own signals where it has none, and single legs.

    A single leg steps at the pace and by the volts of the gait, all its drives together; the volts of the others are 0.

    Raises InputError for a walker that nothing drives.
    """
    layout, gait = scene.robot.layout(), scene.gait
    if gait is None and scene.signals:
        return [Recording("walk-1", Purpose.WALKING, None, scene.duration, signals=scene.signals)]
    if gait is None or layout is None:
        raise InputError(f"'{scene.name}' does not walk: give it a gait, or signals")
    walks = [
        walk(scene, gait.model_copy(update={"frequency": float(f"{pace * gait.frequency:.9g}")}), f"walk-{number}")
        for number, pace in enumerate(PACES, start=1)
    ]
    return walks + exercises(layout, gait)


def walk(scene: Scene, gait: AnyGait, name: str, repeats: int = REPEATS, periods: int = PERIODS) -> Recording:
    """Some periods of a gait."""
    seconds = periods / gait.frequency
    return Recording(name, Purpose.WALKING, None, seconds, repeats=repeats, gait=gait, signals=scene.signals)


def exercises(layout: Layout, gait: AnyGait, said: str = "", periods: int = PERIODS) -> list[Recording]:
    """Single legs that step at the pace and by the volts of a gait while the others stand."""
    half = 0.5 * (gait.high - gait.low)
    step = Square(amplitude=half, offset=gait.low + half, frequency=gait.frequency, duty=gait.duty)
    seconds, groups = periods / gait.frequency, layout.groups
    out = []
    for legs in evenly(groups, MOST_LEGS):
        alone = dict.fromkeys((name for name, reach in layout.drives.items() if reach.legs == legs), step)
        name = f"exercise-{'-'.join(legs)}{said}"
        out.append(Recording(name, Purpose.WALKING, None, seconds, repeats=1, signals=alone))
    return out
