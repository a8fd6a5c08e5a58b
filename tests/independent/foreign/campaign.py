"""A campaign of the foreign laboratory: MATLAB files as an instrument leaves them, campaign.toml and device.toml."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import lru_cache
from itertools import pairwise
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicHermiteSpline, CubicSpline
from scipy.io import savemat
from scipy.signal import butter

from independent.foreign.drive import Wave
from independent.foreign.instruments import noise as coloured
from independent.foreign.instruments import seen_by
from independent.foreign.motion import Motion, Moved, filtered
from independent.foreign.world import Device, World

Floats = NDArray[np.float64]
FAR = 0.03
"""Gap [m] of records in the air."""
_FEWEST = 4
"""Places that a cubic goes through; between fewer the motion runs straight."""
WANDER = 1e-6
"""Standard deviation [m] of the displacements' zero from record to record."""
RAMPS = ((5.0, 0.25, 3), (5.0, 0.5, 3), (5.0, 1.0, 3), (20.0, 0.5, 4), (20.0, 1.0, 4), (60.0, 1.0, 8), (100.0, 1.0, 10))
"""Ramped squares: frequency [Hz], share of ramps, periods."""
OTHER = "ramps-100hz-100-2.mat"
"""File that another device than the others may have left."""
SWAPPED = "ramps-60hz-100-2.mat"
"""File in which the cables of tip and centre may be swapped."""
ON_DUST = 0.2
"""Adhesion on a grain over that on the whole foot."""
DUSTY = 3
"""One file in so many has a grain under the foot, at random."""
RING_HZ, RING_S = 410.0, 0.02
"""Frequency and decay time of a head that rings."""
TABLE_HZ = 35.0
"""Frequency [Hz] of a table's vibration."""
_SWEEPS, _PLACE, _IMPACTS, _ALL = 3, 20, 34, 46
"""Numbers of the middle sweep, ramps and bounces among all files, and how many these are."""
BOUNCES = ((1.25, 300.0), (2.25, 300.0))
"""Square waves that make the foot bounce: volts, hertz."""


@dataclass(frozen=True)
class Record:
    """One experiment: duration and rest before it [s]; gap [m], None for the device's own; share of the rate."""

    name: str
    purpose: str
    wave: Wave
    duration: float
    repeats: int
    rest: float = 0.01
    gap: float | None = None
    share: int = 1
    air: str | None = None


def planned(rate: float) -> list[Record]:
    """46 files: sweeps, static loops, ramped squares, bounces and the same in the air, signals kept for validation."""
    out = []
    for number in range(6):
        seconds = 1.0 + 0.1 * number
        low, high = 200.0, 0.45 * rate
        high = 2.0 * float(np.floor(0.5 * (low + high) * seconds)) / seconds - low  # ends where the sine is zero
        ends = (low, high) if number % 2 == 0 else (high, low)
        keys = dict(amplitude=0.2, start_frequency=ends[0], stop_frequency=ends[1], duration=seconds)
        out.append(Record(f"sweep-{number + 1}", "modal", Wave("swept_sine", keys), 1.8, 1, 0.0, FAR))
    levels = np.array([0.0, -8.0, 8.0, -6.0, 6.0, -4.0, 4.0, 0.0])
    times = np.concatenate([[0.0], np.cumsum(np.abs(np.diff(levels)) / 28.0)])
    stairs = Wave("sampled", dict(times=times.tolist(), levels=levels.tolist()))
    out.append(Record("loops", "loops", stairs, 3.0, 3, 0.1, None, 20))
    for hz, duty, periods in RAMPS:
        wave = Wave("ramped_square", dict(amplitude=8.0, frequency=hz, duty=duty))
        out.append(Record(f"ramps-{hz:g}hz-{100 * duty:g}", "ramps", wave, periods / hz, 3))
    for volts, hz in BOUNCES:
        wave, level = Wave("square", dict(amplitude=volts, frequency=hz)), f"{1000 * volts:g}mv-{hz:g}hz"
        out.append(Record(f"bounces-{level}", "bounces", wave, 0.2, 3, air=f"air-{level}"))
        out.append(Record(f"air-{level}", "air", wave, 0.2, 3, gap=FAR))
    for kind, volts, hz in (("square", 6.0, 15.0), ("square", 8.0, 50.0), ("sine", 8.0, 15.0), ("sine", 6.0, 100.0)):
        wave = Wave(kind, dict(amplitude=volts, frequency=hz))
        out.append(Record(f"held-out-{kind}-{volts:g}v-{hz:g}hz", "validation", wave, 6.0 / hz, 1))
    return out


def write_campaign(
    folder: Path,
    device: Device,
    world: World,
    seed: int = 1,
    rate: float = 20e3,
    decibels: float = 40.0,
    name: str = "foreign",
) -> Path:
    """Simulate and record a campaign; its file is returned.

    Parameters
    ----------
    folder
        Gets campaign.toml, device.toml (which holds nothing that is to be found) and one .mat a record.
    device, world
        What it truly is.
    seed
        Of the instruments' noise.
    rate
        Samples per second [Hz].
    decibels
        Noise of each channel below its own motion.
    """
    folder.mkdir(parents=True, exist_ok=True)
    between = np.isfinite(world.filtered) or world.behind or world.pace or world.trigger or world.jitter
    # a cubic through places and speeds is 0.2 % off the second mode between halves of samples, 0.02 between quarters
    steps = 8 if between else 4 if world.late else 2
    kept = dict[str, Moved]() if world.changing else _kept(device, world.moving, steps, rate)
    motion = Motion(device, world, steps)
    random = np.random.default_rng([seed, 41])
    head = [
        f'name = "{name}"',
        'device = "device.toml"',
        'foot = "tip"',
        'drive = "pzt"',
        "",
        "[defaults]",
        'rest = "10 ms"',
        'drive = "volts"',
        "",
        "[defaults.channels]",
        'volts = "V"',
    ]
    for point in ("tip", "center"):
        head += [f'{point}_x = {{ unit = "um", point = "{point}" }}']
        head += [f'{point}_v = {{ unit = "mm/s", point = "{point}" }}']
    head.append("")
    number = 0
    for record in planned(rate):
        files = []
        moved = kept.get(record.name)
        for repeat in range(record.repeats):
            file = f"{record.name}-{repeat + 1}.mat" if record.repeats > 1 else f"{record.name}.mat"
            if moved is None or world.changing:
                now = _now(device, world, record, number, file)
                gap = now.gap + world.drift * number
                gap += _aside(world.remounted * device.gap, random)
                aimed = replace(world, spot=world.spot + _aside(world.roams, random))
                own = motion if now == device and aimed == world else Motion(now, aimed, steps)
                moved = _moved(own, record, rate / record.share, gap)
                kept[record.name] = moved
            number += 1
            begun = replace(world, gain=world.gain * (1.0 + world.warming * number / 46.0))
            begun = replace(begun, behind=world.behind + _aside(world.trigger, random))
            seen = _recorded(record, moved, begun, rate / record.share, decibels, random)
            savemat(folder / file, _swapped(seen) if world.swapped and file == SWAPPED else seen)
            files.append(file)
        head += list(_set(record, files))
    (folder / "campaign.toml").write_text("\n".join(head) + "\n")
    (folder / "device.toml").write_text(_known(device, world))
    return folder / "campaign.toml"


@lru_cache(maxsize=1)
def _kept(device: Device, world: World, steps: int, rate: float) -> dict[str, Moved]:
    """Motions of the last device, by record, for worlds that differ in their instruments alone: most of the effort."""
    return {}


def _aside(deviation: float, random: np.random.Generator) -> float:
    return deviation * random.standard_normal() if deviation else 0.0


def _now(device: Device, world: World, record: Record, number: int, file: str) -> Device:
    """The device, and its place above the ground, as it is in one file."""
    warmer, damper, duller = ((number - since) / _ALL for since in (_SWEEPS, _PLACE, _IMPACTS))
    heated = 0.0 if record.purpose == "modal" else world.warmer
    device = replace(
        device,
        frequencies=tuple(f * (1.0 + world.softening * warmer - heated) for f in device.frequencies),
        adhesion=tuple(a * (1.0 + world.humid * damper) for a in device.adhesion),
        restitution=device.restitution * (1.0 + world.dulling * duller),
    )
    if world.dust and np.random.default_rng([number, 71]).integers(DUSTY) == 0:
        device = replace(
            device,
            gap=device.gap - world.dust,
            adhesion=tuple(ON_DUST * one for one in device.adhesion),
            film=(device.film[0], device.film[1] + world.dust),
        )
    return device.drawn(world.other, 5) if world.other and file == OTHER else device


def _moved(motion: Motion, record: Record, rate: float, gap: float) -> Moved:
    """The motion, a little longer than the record where a clock runs fast."""
    longer = record.duration * (1.0 + 2.0 * abs(motion.world.pace)) + (8.0 / rate if motion.world.pace else 0.0)
    if record.purpose == "modal":
        return motion.swept(record.wave, rate, longer)
    finer = Motion(motion.device, motion.world, motion.steps * record.share) if record.share > 1 else motion
    return finer.driven(record.wave, rate, longer, gap if record.gap is None else record.gap)


def _recorded(
    record: Record, moved: Moved, world: World, rate: float, decibels: float, random: np.random.Generator
) -> dict[str, object]:
    """Channels of a file: um, mm/s and V."""
    count = int(np.floor(record.duration * rate * (1.0 + 1e-12)))
    rest = round(record.rest * rate)
    time = np.arange(-rest, count) / rate
    driving = np.maximum(time, 0.0)
    volts = np.where(time >= 0.0, record.wave.volts(driving), 0.0)
    phase = 2.0 * np.pi * random.random() if world.table else 0.0
    gone = random.integers(len(time), size=random.poisson(world.dropped * len(time) / rate)) if world.dropped else []
    out: dict[str, object] = {"fs": rate, "volts": np.round(volts / (20.0 / 2**16)) * (20.0 / 2**16)}
    fine = rate * moved.fine
    own = np.arange(moved.x.shape[1]) / fine
    for k, point in enumerate(("tip", "center")):
        for quantity, motion, speed, factor in (("x", moved.x[k], moved.v[k], 1e6), ("v", moved.v[k], None, 1e3)):
            if record.purpose == "modal" and quantity == "v":
                continue
            late = world.behind + (world.late if quantity == "x" else 0.0)
            at = time * (1.0 + world.pace) - late
            if world.jitter:
                at = at + world.jitter * random.standard_normal(len(at))
            if world.echo and point == "center":
                motion, speed = (
                    motion + world.echo * (moved.x if quantity == "x" else moved.v)[0],
                    None if speed is None else speed + world.echo * moved.v[0],
                )
            if np.isfinite(world.filtered):
                motion, speed = _passed(motion, world.filtered, fine), None
            if late or world.pace or world.jitter:
                seen = np.interp(at, own, motion)
                inside = at > 0.0
                seen[inside] = _between(own, motion, speed, at[inside], moved.breaks)
                seen[~inside] = motion[0]
            else:
                seen = np.concatenate([np.full(rest, motion[0]), motion[:: moved.fine][:count]])
            noise = float(np.sqrt(np.mean(seen[rest:] ** 2))) * 10.0 ** (-decibels / 20.0)
            if quantity == "x":
                seen = seen + world.hum * noise * np.sin(2.0 * np.pi * 50.0 * time + 6.0 * random.random())
                seen = seen + (WANDER * random.standard_normal() if record.purpose != "modal" else 0.0)
                seen = seen * (world.gain if point == "tip" or world.warming else 1.0)
            elif world.warming:
                seen = seen * world.gain
            seen = seen * (world.speeds if quantity == "v" else 1.0)
            seen = seen + (world.into_x if quantity == "x" else world.into_v) * volts
            if world.wanders and quantity == "x":
                seen = seen + world.wanders * random.standard_normal() * time
            if world.table:
                turn = 2.0 * np.pi * TABLE_HZ
                shaken = world.table * np.exp(1j * (turn * time + phase))
                seen = seen + (shaken.imag if quantity == "x" else turn * shaken.real)
            if world.rings:
                shaken = world.rings * _ringing(time, moved.events)
                seen = seen + (shaken.imag if quantity == "x" else 2.0 * np.pi * RING_HZ * shaken.real)
            still = float(seen[0])
            seen = seen + coloured(len(seen), noise, world, random)
            shown = factor * seen_by(seen, rate, quantity, still, world, random)
            left = np.delete(shown, gone)
            out[f"{point}_{quantity}"] = np.append(left, np.full(len(shown) - len(left), left[-1]))
    return out


def _ringing(time: Floats, events: list[tuple[float, str]]) -> NDArray[np.complex128]:
    """What impacts leave in a structure of one mode, in deviations of one of them (imaginary: displacement)."""
    since = time[:, None] - np.array([at for at, kind in events if kind != "release"])
    turn = (2j * np.pi * RING_HZ - 1.0 / RING_S) * np.maximum(since, 0.0)
    return np.sum(np.exp(turn) * (since > 0.0), axis=1)


def _swapped(channels: dict[str, object]) -> dict[str, object]:
    """Channels of a file with the cables of tip and centre swapped."""
    others = {"tip": "center", "center": "tip"}
    return {
        "_".join([others.get(place, place), *more]): channels[name]
        for name in channels
        for place, *more in [name.split("_")]
    }


def _between(time: Floats, motion: Floats, speed: Floats | None, at: Floats, breaks: Floats) -> Floats:
    """Motion at increasing times between samples: by its speed as well where that is known; a speed, which bends where
    the drive jumps and jumps at impacts, by a spline of its own between any two of these breaks."""
    inside = np.minimum(at, time[-1])
    if speed is not None:
        return np.asarray(CubicHermiteSpline(time, motion, speed)(inside))
    out = np.interp(inside, time, motion)
    edges = np.concatenate([[-np.inf], np.unique(breaks), [np.inf]])
    for known, wanted in zip(
        pairwise(np.searchsorted(time, edges)), pairwise(np.searchsorted(inside, edges)), strict=True
    ):
        if known[1] - known[0] >= _FEWEST and wanted[1] > wanted[0]:
            own = slice(*known)
            out[slice(*wanted)] = CubicSpline(time[own], motion[own])(inside[slice(*wanted)])
    return out


def _passed(motion: Floats, hertz: float, fine: float) -> Floats:
    """Behind an analogue low-pass of fourth order, [Hz]: a digital one of that corner is 0.8 % less late at twenty
    samples a period."""
    turn = 2.0 * np.pi * hertz
    _, poles, gain = butter(4, 1.0, analog=True, output="zpk")
    apart = poles[:, None] - poles
    shares = gain / np.prod(apart, axis=1, where=apart != 0.0)
    push = (motion - motion[0]).astype(complex)
    behind = [
        turn * share * filtered(turn * pole, push, 0.0, 1, fine) for pole, share in zip(poles, shares, strict=True)
    ]
    return np.sum(behind, axis=0).real + motion[0]


def _set(record: Record, files: list[str]) -> Iterator[str]:
    yield f"[records.{record.name}]"
    yield f'purpose = "{record.purpose}"'
    yield f"files = {files!r}".replace("'", '"')
    if record.rest != 0.01:
        yield f'rest = "{1000 * record.rest:g} ms"'
    if record.gap is not None:
        yield f'gap = "{1000 * record.gap:g} mm"'
    if record.air is not None:
        yield f'air = "{record.air}"'
    signal = ", ".join(f"{key} = {value!r}" for key, value in record.wave.parameters.items())
    yield f'signal = {{ kind = "{record.wave.kind}", {signal} }}'
    yield ""


def _known(device: Device, world: World) -> str:
    """What is known beforehand, as a scene file: geometry, gap, thresholds, history; the rest says nothing."""
    long, wide, thick = world.long * device.tip[0], *device.tip[1:]
    blank = '{ source = "assumed", note = "Placeholder, to be identified." }'
    unknown = (
        "robot.structure.frequencies",
        "robot.structure.damping_ratios",
        "robot.drives.pzt.load.participation",
        *(f"robot.drives.pzt.law.{key}" for key in ("constant", "linear", "quadratic", "cubic", "weights")),
        "ground.restitution.coefficient",
        "ground.adhesion.initial",
        "ground.adhesion.rate",
        "ground.film.coefficient",
        "ground.film.thickness",
    )
    lines = [
        'name = "foreign"',
        "duration = 0.2",
        "",
        "[robot.structure]",
        'kind = "beam"',
        "frequencies = [600.0, 6000.0]",
        "damping_ratios = [0.02, 0.02]",
        f"length = {device.length}",
        f"tip_length = {long}",
        f"tip_width = {wide}",
        f"tip_thickness = {thick}",
        f"tip_density = {device.density}",
        "",
        "[robot.drives.pzt]",
        f"history = {list(device.history)}",
        "",
        "[robot.drives.pzt.load]",
        'kind = "modal"',
        f"participation = [{device.participation[0]}, 1.0]",
        "",
        "[robot.drives.pzt.law]",
        'kind = "prandtl_ishlinskii"',
        "constant = 0.0",
        "linear = 1e-6",
        "quadratic = 0.0",
        "cubic = 0.0",
        f"thresholds = {list(device.thresholds)}",
        f"weights = {[0.0] * len(device.weights)}",
        "",
        "[robot.feet.tip]",
        'point = "tip"',
        f"gap = {world.gap * device.gap}",
        "normal = 1",
        "[ground]",
        "near_field_forces = true",
        "",
        "[ground.restitution]",
        "coefficient = 0.5",
        "",
        "[ground.landing]",
        'kind = "capture_unless_pulled"',
        "",
        "[ground.adhesion]",
        "initial = 0.0",
        "rate = 0.0",
        "",
        "[ground.film]",
        "coefficient = 1e-20",
        "thickness = 1e-5",
        "",
        "[signals.pzt]",
        'kind = "square"',
        "amplitude = 8.0",
        "frequency = 50.0",
        "",
        "[provenance]",
        *(f'"{path}" = {blank}' for path in unknown),
    ]
    return "\n".join(lines) + "\n"
