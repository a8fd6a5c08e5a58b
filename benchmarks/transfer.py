"""From records of a robot that somebody else simulates to a gait that walks there: a row each.

Run ``python benchmarks/transfer.py [robots] [first seed] [out.csv]``. Every robot has two to six legs, in turn; its
legs' springs and dampers, its ground and its gait are drawn by chance. It walks in the second simulator of
``tests/independent``, which shares no formula with the library, and is seen at 20 kHz by its body's motion to 100 nm
and 50 um/s (angles at the hips as much). What is known beforehand is the drawing of its legs to 10 %, and the ground to
a power of ten. From that record the legs and the ground are identified. A second walk, with another gait, is left out:
by as much as its speed is off what draws of the identified numbers predict, every stated interval is wider. On the
draws a gait is designed, with the interval in which its speed lies; and it walks in the second simulator again.

A row is appended for each robot, and those that are there already are left out, so that a run that was stopped goes on.
The last line is of all rows of the file: what is claimed, before any is run, is that the interval holds the speed in
80 % of the robots, and that the designed gait is faster than the first one in 90 %. Exit code 1 where either fails.

``python benchmarks/transfer.py record SEED FOLDER`` instead: the records of a robot, what is known of it, and
the robot itself, as files.
"""

from __future__ import annotations

import csv
import sys
import time
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

import tarsus as ts
from rows import append_missing
from tarsus.base.quantities import Quantity
from tarsus.base.spec import get_value, validate
from tarsus.design import Grounds
from tarsus.files.toml import write_scene
from tarsus.identify.campaign import RecordSet
from tarsus.identify.walk_prediction import reliance_of
from tarsus.identify.walk_step import identify_walking, walk_records
from tarsus.model.scene import Scene
from tarsus.records.measurement import Channel, Measurement
from tarsus.records.purpose import Purpose
from tarsus.synthesis.campaign_folder import unknown_device
from tarsus.synthesis.devices import perturbed
from tarsus.synthesis.record_files import write_hdf

sys.path.insert(0, str(Path(__file__).parents[1] / "tests"))
from independent import simulate
from independent.bodies import robot_of

Floats = NDArray[np.float64]

RECORDED, RATE, WALKED = 0.06, 20e3, 0.1
"""Length of the record [s], its sampling [Hz], and length of the walks that gaits are judged by [s]."""
LEFT_OUT = (40.0, 120.0)
"""Frequencies of the gait that is left out [Hz]; of its legs' phases any."""
LENGTH, SPEED, HALF = 1e-7, 5e-5, 1e-3
"""Noise of displacements [m] and velocities [m/s], and the arm at which angles are seen as these [m]."""
SPREAD = 0.1
FLIGHT, TOLERANCE = 1e-5, 1e-7
"""Of the second simulator: length of the motion [m], of which flights below a billionth are none, and its tolerance:
a tenth of a nanometre in a walk of tens of micrometres, far below what a record shows."""
FREE = {"gait.frequency": None, "gait.duty": (0.2, 0.8), "gait.phases": None}
CANDIDATES, LOOK = 72, 24
"""Gaits that a design tries, and a quarter of the draws that its interval is of, which needs 93."""
HOLDS, BEATS = 0.8, 0.9


def drawing(seed: int) -> Scene:
    """A walker with two to six legs in pairs, an odd one in the middle, and what a gait at 12 V does with it."""
    rng = np.random.default_rng([seed, 83])

    def between(low: float, high: float) -> float:
        return float(rng.uniform(low, high))

    def factor(low: float, high: float) -> float:
        return float(np.exp(rng.uniform(np.log(low), np.log(high))))

    count = 2 + seed % 5
    stiffness, foot, mass = factor(0.3, 0.8), 20e-9, 2e-7 * count
    legs, drives = dict[str, object](), dict[str, object]()
    for i in range(count):
        name, pairs = f"leg{i + 1}", max((count - 1) // 2, 1)
        up, along = stiffness * between(0.9, 1.1), 1.5 * stiffness * between(0.9, 1.1)
        legs[name] = {
            "x": 0.0 if count == 2 else HALF * (1.0 - 2.0 * (i // 2) / pairs),
            "y": 0.0 if count % 2 and i == count - 1 else HALF * (-1) ** i,
            "z": 0.0,
            "mass": foot,
            "stiffness_v": up,
            "stiffness_l": along,
            "damping_v": 0.2 * np.sqrt(up * foot) * between(0.9, 1.1),
            "damping_l": 0.4 * np.sqrt(along * foot) * between(0.9, 1.1),
        }
        weights = {name: -1.0, f"{name}_hip": 1.0, f"{name}_x": -0.4, f"{name}_hip_x": 0.4}
        drives[name] = {
            "load": {"kind": "point", "weights": weights},
            "law": {"kind": "linear", "gain": stiffness * 1e-6 * between(0.95, 1.05)},
        }
    turning = {"roll_inertia": 4e-7 * mass, "pitch_inertia": 1e-6 * mass} if count > 2 else {}
    ground = {
        "gravity": {"acceleration": 9.81},
        "landing": {"kind": "restitute_first", "speed": 5e-4},
        "restitution": {"coefficient": between(0.2, 0.7)},
        "friction": {"coefficient": between(0.25, 0.7)},
        "adhesion": {"initial": factor(5e-8, 5e-7), "rate": factor(1e-6, 1e-5)},
        "film": {"coefficient": factor(1e-24, 1e-23), "thickness": 2e-7},
    }
    gait = {
        "kind": "free",
        "frequency": between(40.0, 80.0),
        "high": 12.0,
        "phases": {name: 0.5 * ((i // 2 + i) % 2) for i, name in enumerate(legs)},
    }
    structure = {"kind": "walker", "body": {"mass": mass, "length": 3e-3, **turning}, "legs": legs}
    feet = {name: {"point": name, "gap": 0.0} for name in legs}
    return validate(
        Scene,
        {
            "name": f"walker {seed}",
            "duration": WALKED,
            "ground": ground,
            "gait": gait,
            "initial": {"standing": {}},
            "robot": {"structure": structure, "drives": drives, "feet": feet},
        },
    )


def driven(scene: Scene, seconds: float) -> Scene:
    """The scene as the second simulator takes it: square waves in place of a gait, and where it stands with all feet on
    the ground, by its own matrices."""
    gait, robot = scene.gait, robot_of(scene)
    waves = {
        name: {
            "kind": "square",
            "amplitude": 0.5 * (gait.high - gait.low),
            "offset": 0.5 * (gait.high + gait.low),
            "frequency": gait.frequency,
            "duty": gait.duty,
            "phase": 2.0 * np.pi * (-gait.phases[name] % 1.0),
        }
        for name in scene.robot.drives
    }
    rows = np.hstack([robot.normals, robot.tangents])
    n, held = rows.shape
    both = np.block([[robot.stiffness, rows], [rows.T, np.zeros((held, held))]])
    weight = scene.ground.gravity.acceleration * robot.mass @ robot.up
    x = np.linalg.lstsq(both, np.concatenate([-weight, np.zeros(held)]), rcond=1e-12)[0][:n]
    x -= robot.normals @ (robot.normals.T @ x)  # rounding: feet are on the ground
    changes = {"gait": None, "signals": waves, "initial": {"displacement": x.tolist()}, "duration": seconds}
    return ts.with_values(scene, changes)


def walked(scene: Scene, seconds: float, times: Sequence[float]) -> Floats:
    """States (nt, 2n) of a walk in the second simulator."""
    longer = driven(scene, seconds)
    return simulate(longer, FLIGHT, times, TOLERANCE).states


def speed_of(scene: Scene) -> float:
    """Speed [m/s] over all whole drive periods but the first third, in the second simulator; NaN where it jams."""
    times = speed_times(scene)
    return speed_between(times, walked(scene, WALKED, times.tolist()))


def speed_times(scene: Scene) -> Floats:
    """Begin and end [s] of the periods that a speed is of."""
    period = 1.0 / scene.gait.frequency
    count = int(WALKED / period + 1e-9)
    return period * np.array([-(-count // 3), count])


def speed_between(times: Floats, states: Floats) -> float:
    """Speed [m/s] between two times at which the states are these; NaN where there are fewer."""
    return float((states[1, 0] - states[0, 0]) / (times[1] - times[0])) if len(states) == 2 else np.nan


def other_gait(scene: Scene, seed: int) -> Scene:
    """The scene with the gait that is left out of the identification."""
    rng = np.random.default_rng([seed, 89])
    phases = {name: float(rng.random()) for name in scene.gait.phases}
    return ts.with_values(scene, {"gait.frequency": float(rng.uniform(*LEFT_OUT)), "gait.phases": phases})


def recorded(truth: Scene, seed: int, seconds: float = RECORDED) -> Measurement:
    """What instruments see of the body: surge and heave, roll and pitch where it turns, and their rates."""
    times = np.arange(round(seconds * RATE)) / RATE
    return shown(truth, seed, times, walked(truth, seconds, times.tolist()))


def recorded_and_speed(truth: Scene, seed: int) -> tuple[Measurement, float]:
    """`recorded` and `speed_of`, of one walk."""
    times, ends = np.arange(round(RECORDED * RATE)) / RATE, speed_times(truth)
    every = np.union1d(times, ends)
    states = walked(truth, WALKED, every.tolist())
    there = ends[ends <= every[len(states) - 1]]
    found, speed = (states[np.searchsorted(every, one)] for one in (times, there))
    return shown(truth, seed, times, found), speed_between(ends, speed)


def shown(truth: Scene, seed: int, times: Floats, states: Floats) -> Measurement:
    """What instruments show of states (nt, 2n)."""
    turns = [name for name in truth.robot.structure.body_coordinates if name in ("roll", "pitch")]
    size, n = 2 + len(turns), states.shape[1] // 2
    ways = [Quantity.DISPLACEMENT] * 2 + [Quantity.ANGLE] * len(turns)
    rates = [Quantity.VELOCITY] * 2 + [Quantity.ANGULAR_VELOCITY] * len(turns)
    arms = np.array([1.0, 1.0, *(HALF for _ in turns)])
    noise = np.concatenate([LENGTH / arms, SPEED / arms])
    values = states[:, [*range(size), *range(n, n + size)]].T
    values = values + noise[:, None] * np.random.default_rng([seed, 41]).standard_normal(values.shape)
    digit = 0.01 * noise[:, None]
    seen = zip([*ways, *rates], ["body_x", "body", *turns] * 2, noise.tolist(), strict=True)
    channels = [Channel(f"{at} {kind.name.lower().replace('_', ' ')}", kind, at, own) for kind, at, own in seen]
    channels.append(Channel("trigger volts", Quantity.VOLTAGE))  # of the first leg, which begins at once
    volts = np.where(times * truth.gait.frequency % 1.0 < truth.gait.duty, truth.gait.high, truth.gait.low)
    values = np.vstack([digit * np.rint(values / digit), volts])
    return Measurement(tuple(channels), values, 1.0 / RATE, source="walk.h5", drive="trigger volts")


def row_of(seed: int) -> dict[str, object]:
    """One robot: how well it is identified, and speeds [um/s] of its gaits, stated and achieved."""
    begun, nominal = time.process_time(), drawing(seed)
    truth, known = perturbed(nominal, SPREAD, seed), unknown_device(nominal)
    (record, first), other = recorded_and_speed(truth, seed), other_gait(truth, seed)
    seen, unseen = (
        walk_records(known, "walk", RecordSet(purpose=Purpose.WALKING, files=("walk.h5",), gait=scene.gait), [record])
        for scene, record in ((truth, record), (other, recorded(other, seed + 1, WALKED)))
    )
    recording, begun = time.process_time() - begun, time.process_time()
    found = identify_walking(known, seen, seed, left_out=unseen)
    reliance = reliance_of(found.checks)
    identifying, begun = time.process_time() - begun, time.process_time()
    told = [j for j, path in enumerate(found.paths) if path not in found.taken]
    ends = np.quantile(found.samples[:, told], [0.025, 0.975], axis=0)
    true = np.array([get_value(truth, found.paths[j]) for j in told])
    device = ts.with_values(known, dict(zip(found.paths, found.values.tolist(), strict=True)))
    front = ts.design.gait(
        device,
        FREE,
        "speed",
        over=Grounds.of_points(found.paths, found.samples, reliance),
        risk="mean",
        from_rest=WALKED,
        candidates=CANDIDATES,
        look=LOOK,
        seed=seed,
        threads=1,
    )
    gait = front.robust
    designing, begun = time.process_time() - begun, time.process_time()
    low, high = gait.intervals[0]
    achieved = speed_of(ts.with_values(truth, {"gait": front.scene_of(gait).gait}))
    walking = time.process_time() - begun
    speeds = {"first": first, "stated": gait.risk[0], "low": low, "high": high, "achieved": achieved}
    costs = {"recording": recording, "identifying": identifying, "designing": designing, "walking": walking}
    return {
        "seed": seed,
        "legs": len(nominal.robot.feet),
        "told": len(told),
        "numbers": len(found.paths),
        "inside": int(((ends[0] <= true) & (true <= ends[1])).sum()),
        "doubts": " and ".join(one.name.partition(",")[0] for one in found.checks if not one.passed),
        "missed": _round(reliance.missed),
        **{name: _round(1e6 * value) for name, value in speeds.items()},
        "holds": int(low <= achieved <= high),
        "beats": int(achieved > first),
        **{f"{name}_s": _round(value) for name, value in costs.items()},
    }


def write_record(seed: int, folder: Path) -> None:
    """The records of a robot, what is known of it, and the robot itself."""
    folder.mkdir(parents=True, exist_ok=True)
    nominal = drawing(seed)
    truth = perturbed(nominal, SPREAD, seed)
    write_hdf(recorded(truth, seed), folder / "walk.h5")
    other = replace(recorded(other_gait(truth, seed), seed + 1, WALKED), source="other.h5")
    write_hdf(other, folder / "other.h5")
    write_scene(unknown_device(nominal), folder / "robot.toml")
    write_scene(truth, folder / "truth.toml")


def _round(value: float) -> float:
    return float(f"{value:.4g}")


def together(file: Path) -> tuple[str, bool]:
    """All rows of a file in a line, and whether what is claimed of them is so."""
    with file.open(newline="", encoding="utf-8") as lines:
        rows = list(csv.DictReader(lines))
    count = len(rows)
    holds, beats, inside, told = (sum(int(row[name]) for row in rows) for name in ("holds", "beats", "inside", "told"))
    said = (
        f"of {count} robots {holds} walk at a speed within the stated interval and {beats} faster than at first; "
        f"{inside} of {told} intervals of what was identified hold"
    )
    return said, holds >= HOLDS * count and beats >= BEATS * count


def main() -> int:
    """Rows of robots that are not there yet, and the line of all; or records."""
    if sys.argv[1:2] == ["record"]:
        write_record(int(sys.argv[2]), Path(sys.argv[3]))
        return 0
    count, first = (int(one) for one in (*sys.argv[1:3], *("20", "0")[len(sys.argv[1:3]) :]))
    file = Path(sys.argv[3] if len(sys.argv) > 3 else "transfer.csv")
    append_missing(file, range(first, first + count), row_of)
    said, sound = together(file)
    print(said)
    return int(not sound)


if __name__ == "__main__":
    sys.exit(main())
