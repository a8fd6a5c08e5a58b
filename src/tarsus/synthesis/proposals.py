"""Records that could be taken next: ramped squares and sweeps of a device, gaits and single legs of a walker."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import product

from tarsus.base.errors import InputError
from tarsus.base.messages import nearest
from tarsus.base.units import format_quantity
from tarsus.model.drive.gait import Layout
from tarsus.model.drive.laws import LinearForce, PrandtlIshlinskii
from tarsus.model.drive.waveforms import RampedSquare
from tarsus.model.scene import Scene
from tarsus.records.purpose import Purpose
from tarsus.synthesis.plan import in_air
from tarsus.synthesis.recordings import Recording
from tarsus.synthesis.walks import exercises, walk

UNITS = {"hz": "Hz", "volts": "V", "ramp": "1", "gap": "m"}
"""What records may differ in, with units."""
HZ = (0.1, 0.3, 1.0, 2.0)
"""Frequencies unless others are asked for, in that of a device's own signal or gait."""
VOLTS = (0.25, 0.5, 0.75, 1.0)
"""And amplitudes: none is stronger than what the device has."""
RAMPS = (0.0, 0.25)
PERIODS = 4
"""Of a record: windows have starts of their own, so that none is lost to a transient, and a plan may take more. Of a
gait more, which begins with few steps (`tarsus.synthesis.walks.PERIODS`)."""
PACES, STRENGTHS = (0.1, 1.0), (0.5, 1.0)
"""The same of walkers: a foot that steps slowly has long contacts, and softly ones that the film shows in."""


def proposals(scene: Scene, vary: Mapping[str, Sequence[float]], rate: float) -> list[Recording]:
    """Records of every combination of what is varied, about a scene's own signal or gait where nothing else is asked
    for, and never stronger.

    Of a walker its gait and its legs one by one while the others stand, by ``hz`` and ``volts``. Else ramped squares
    on every drive with a signal, by ``hz``, ``volts``, ``ramp`` (lambda, the share of half a period that each ramp
    takes) and ``gap``; and, where nothing is asked for, a sweep and slow loops in the air, sampled at a rate [Hz].

    Raises
    ------
    InputError
        For what records do not differ in, a scene without a signal to go by, and values that a signal cannot have.
    """
    layout = scene.robot.layout()
    offered = ("hz", "volts") if layout is not None else tuple(UNITS)
    problems = [
        f"vary: candidates differ in {', '.join(offered)}, not in '{name}'{nearest(name, offered)}"
        for name in vary
        if name not in offered
    ]
    if problems:
        raise InputError(problems)
    if layout is not None:
        return _walks(scene, layout, vary)
    found = _squares(scene, vary)
    drive = next(iter(scene.robot.drives.values()))
    if not vary and len(scene.robot.drives) == 1 and isinstance(drive.law, LinearForce | PrandtlIshlinskii):
        sweep, *_, loops = in_air(scene, rate, next(iter(scene.robot.drives)))
        found += [sweep, loops]
    return found


def _walks(scene: Scene, layout: Layout, vary: Mapping[str, Sequence[float]]) -> list[Recording]:
    gait = scene.gait
    if gait is None:
        raise InputError(f"'{scene.name}' has no gait to go by")
    out: list[Recording] = []
    paces = vary.get("hz") or _parts(gait.frequency, PACES)
    for hz, volts in product(paces, vary.get("volts") or _parts(gait.high - gait.low, STRENGTHS)):
        step = gait.model_copy(update={"frequency": hz, "high": gait.low + volts})
        said = f" at {format_quantity(hz, 'Hz')}, {format_quantity(volts, 'V')}"
        out += [walk(scene, step, f"gait{said}", 1), *exercises(layout, step, said, PERIODS)]
    return out


def _squares(scene: Scene, vary: Mapping[str, Sequence[float]]) -> list[Recording]:
    own = next((one for one in scene.signals.values() if hasattr(one, "amplitude") and hasattr(one, "frequency")), None)
    missing = [name for name, key in (("frequencies", "hz"), ("amplitudes", "volts")) if key not in vary]
    if own is None and missing:
        raise InputError(f"the scene has no periodic signal to go by: give {' and '.join(missing)}")
    drives = list(scene.signals) or list(scene.robot.drives)
    if not drives:
        raise InputError(f"'{scene.name}' has no drive for a signal")
    hz = vary.get("hz") or _parts(getattr(own, "frequency", 0.0), HZ)
    volts = vary.get("volts") or _parts(getattr(own, "amplitude", 0.0), VOLTS)
    out = []
    for f, v, ramp, gap in product(hz, volts, vary.get("ramp") or RAMPS, vary.get("gap") or (None,)):
        words = [format_quantity(f, "Hz"), format_quantity(v, "V"), f"lambda {ramp:g}"]
        words += [] if gap is None else [f"gap {format_quantity(gap, 'm')}"]
        wave = RampedSquare(amplitude=v, frequency=f, duty=ramp)
        one = Recording(", ".join(words), Purpose.RAMPS, wave, PERIODS / f, gap=gap, repeats=1)
        out.append(one)
    return out


def _parts(value: float, shares: Sequence[float]) -> list[float]:
    """Shares of a value, to four digits."""
    return [float(f"{share * value:.4g}") for share in shares]
