"""How well the ground under a walker, and its legs, are recovered while it walks: blind robots, a row each.

Run ``python benchmarks/walking_recovery.py [robots] [first seed] [out.csv] [motion|acceleration|currents|charges]``.
Every robot has two, four or six legs, in turn, all springs and dampers of its legs and all numbers of its ground within
10 % of those of the packaged millipede; it walks at 14 V for 0.1 s, and what is known beforehand is the design, and the
ground to a power of ten. Seen at 20 kHz are the motion of its body to 100 nm and 50 um/s (angles at the hips as much),
or, to 40 dB, nothing but the body's acceleration, or the motional currents or charges of its drives. A row is appended
for each robot, and those that are there already are left out, so that a run that was stopped goes on. The last line is
of all rows of the file. Exit code 1 where no number was determined, or where fewer of their intervals hold the truth
than chance has it once in forty.

``python benchmarks/walking_recovery.py cost [legs ...]`` instead: the CPU time of three records of ten channels, by
their length.
"""

from __future__ import annotations

import csv
import sys
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
from scipy.stats import binomtest

import tarsus as ts
from rows import append_missing
from tarsus.base.quantities import Quantity
from tarsus.base.spec import get_value, validate
from tarsus.fit.verdict import Verdict
from tarsus.identify.walk_step import DIFFERING, unknowns_of
from tarsus.identify.walking import WalkFit, WalkRecord, identify_walk
from tarsus.model.scene import Scene
from tarsus.solve.outputs import Output
from tarsus.synthesis.campaign_folder import unknown_device
from tarsus.synthesis.devices import perturbed

SECONDS, RATE, LENGTH, SPEED = 0.1, 20e3, 1e-7, 5e-5
HALF = 1e-3
"""Half of the track and of the distance of legs along the body [m], at which angles are seen as motions."""
NOISE = 0.01
"""Of other channels, as a share of their root mean square: 40 dB."""
SPREAD = 0.1
LEGS = (2, 4, 6)
NAMED = {
    "restitution": "ground.restitution.coefficient",
    "friction": "ground.friction.coefficient",
    "adhesion": "ground.adhesion.initial",
    "film": "ground.film.coefficient",
    "thickness": "ground.film.thickness",
    "growth": "ground.adhesion.rate",
}


def design(legs: int) -> Scene:
    """The packaged millipede at 14 V and 50 Hz, on so many legs: pairs one behind the other, the body as heavy a pair,
    turning about both axes where it has more than one."""
    scene = ts.load_scene("millipede", hz=50, volts=14)
    pairs = legs // 2
    if pairs == 1:
        return scene
    robot = scene.robot.model_dump(exclude_none=True)
    left, right = robot["structure"]["legs"].values()
    places = np.linspace(1.0, -1.0, pairs) * HALF
    old = {"L1": left, "R1": right}
    robot["structure"]["legs"] = {
        f"{side}{k + 1}": old[f"{side}1"] | {"x": x, "y": HALF if side == "L" else -HALF}
        for k, x in enumerate(places.tolist())
        for side in "LR"
    }
    mass = robot["structure"]["body"]["mass"] * pairs
    robot["structure"]["body"] |= {"mass": mass, "roll_inertia": mass * HALF**2, "pitch_inertia": mass * HALF**2}
    for what in ("drives", "feet"):
        robot[what] = {
            f"{side}{k + 1}": _renamed(robot[what][f"{side}1"], f"{side}1", f"{side}{k + 1}")
            for k in range(pairs)
            for side in "LR"
        }
    return validate(Scene, scene.model_dump(exclude_none=True) | {"robot": robot, "provenance": {}})


def _renamed(one: object, old: str, new: str) -> object:
    """A description with the name of a leg in place of another in all names of points and drives."""
    if isinstance(one, dict):
        return {_renamed(key, old, new): _renamed(value, old, new) for key, value in one.items()}
    if isinstance(one, (list, tuple)):
        return type(one)(_renamed(each, old, new) for each in one)
    return new + one.removeprefix(old) if isinstance(one, str) and one.startswith(old) else one


def outputs_of(scene: Scene, seen: str) -> tuple[Output, ...]:
    """Displacement and velocity of the body, and its angles where it turns; or what else is seen."""
    if seen == "acceleration":
        return tuple(Output(Quantity.ACCELERATION, at) for at in ("body_x", "body"))
    if seen in _ELECTRICAL:
        return tuple(Output(_ELECTRICAL[seen], drive, motional=True) for drive in scene.robot.drives)
    turns = [name for name in scene.robot.structure.body_coordinates if name in ("roll", "pitch")]
    out = [Output(kind, at) for kind in (Quantity.DISPLACEMENT, Quantity.VELOCITY) for at in ("body_x", "body")]
    out += [Output(kind, at) for kind in (Quantity.ANGLE, Quantity.ANGULAR_VELOCITY) for at in turns]
    return tuple(out)


_ELECTRICAL = {"currents": Quantity.CURRENT, "charges": Quantity.CHARGE}


def record_of(
    truth: Scene, known: Scene, seed: int, outputs: tuple[Output, ...], seconds: float = SECONDS
) -> WalkRecord:
    """What instruments see of the true robot as it walks; known: the scene that the record is taken for."""
    random = np.random.default_rng([seed, 41])
    times = np.arange(1, round(seconds * RATE) + 1) / RATE
    run = ts.simulate(truth, seconds)
    values = run.outputs(list(outputs), times)
    units = {
        Quantity.DISPLACEMENT: LENGTH,
        Quantity.ANGLE: LENGTH / HALF,
        Quantity.VELOCITY: SPEED,
        Quantity.ANGULAR_VELOCITY: SPEED / HALF,
    }
    shares = NOISE * np.sqrt((values**2).mean(axis=1))
    noise = np.array([units.get(one.quantity, share) for one, share in zip(outputs, shares.tolist(), strict=True)])
    return WalkRecord(known, times, outputs, values + noise[:, None] * random.standard_normal(values.shape), noise)


def row_of(seed: int, seen: str) -> dict[str, object]:
    """One blind robot: errors [%], standard deviations [%] and words of the ground's numbers, and how many intervals of
    the numbers that are determined cover the truth."""
    legs = LEGS[seed % len(LEGS)]
    nominal = design(legs)
    truth, known = perturbed(nominal, SPREAD, seed), unknown_device(nominal)
    begun = time.process_time()
    row: dict[str, object] = {"seed": seed, "legs": legs}
    fit = identify_walk([record_of(truth, known, seed, outputs_of(truth, seen))], unknowns_of(known))
    row |= _judged(fit, truth) | {"cpu_s": round(time.process_time() - begun, 1)}
    return row


def _judged(fit: WalkFit, truth: Scene) -> dict[str, object]:
    true = np.array([float(get_value(truth, path)) for path in fit.paths])
    error, sd = np.log(fit.values / true), np.sqrt(np.diag(fit.covariance))
    words = [fit.verdict(path) for path in fit.paths]
    sure = np.array([word is Verdict.DETERMINED for word in words])
    told = np.array([word is not Verdict.ASSUMED for word in words])
    off = np.abs(error / sd)
    inside = off <= 1.96
    row: dict[str, object] = {
        "windows": len(fit.good),
        "followed": int(fit.good.sum()),
        "numbers": len(true),
        "determined": int(sure.sum()),
        "inside": int((inside & sure).sum()),
        "beyond_2": int((sure & (off > 2.0)).sum()),
        "beyond_3": int((sure & (off > 3.0)).sum()),
        "worst_sd": _round(off[sure].max(initial=0.0)),
        "told": int(told.sum()),
        "inside_told": int((inside & told).sum()),
    }
    for name, path in NAMED.items():
        j = fit.paths.index(path)
        row |= {name: _round(100 * error[j]), f"{name}_sd": _round(100 * sd[j]), f"{name}_word": words[j].value}
    return row


def cost_of(legs: int, seconds: float, seed: int = 0) -> dict[str, object]:
    """CPU time of the identification of three records of ten channels, at three frequencies of the gait: of the body's
    motion, and of accelerations, currents and charges as many as make ten."""
    nominal = design(legs)
    truth, known = perturbed(nominal, SPREAD, seed), unknown_device(nominal)
    kinds = ("motion", "acceleration", "currents", "charges")
    outputs = tuple(one for seen in kinds for one in outputs_of(truth, seen))[:10]
    records = []
    for k, hz in enumerate((50.0, 60.0, 40.0)):
        there, taken = (ts.with_values(one, {"gait.frequency": hz}) for one in (truth, known))
        records.append(replace(record_of(there, taken, seed + k, outputs, seconds), name=f"walk {k}"))
    begun = time.process_time()
    sought = unknowns_of(known)
    fit = identify_walk(records, sought, differing=[path for path in DIFFERING if path in sought])
    spent = time.process_time() - begun
    return {"legs": legs, "ms": 1e3 * seconds, "cpu_s": round(spent, 1)} | _judged(fit, truth)


def _round(value: float) -> float:
    return float(f"{value:.3g}")


def together(file: Path) -> tuple[str, bool]:
    """All rows of a file in a line, and whether intervals of determined numbers hold the truth as often as they say."""
    with file.open(newline="", encoding="utf-8") as lines:
        rows = list(csv.DictReader(lines))
    names = ("inside", "determined", "beyond_2", "beyond_3", "followed", "windows")
    inside, sure, two, three, followed, windows = (sum(int(row[name]) for row in rows) for name in names)
    said = (
        f"{inside} of {sure} intervals of determined numbers hold, {two} are beyond 2 sd and {three} beyond 3; "
        f"{followed} of {windows} windows followed"
    )
    return said, sure > 0 and binomtest(inside, sure).proportion_ci(0.95).high >= 0.95


def main() -> int:
    """Rows of robots that are not there yet, or the cost."""
    if sys.argv[1:2] == ["cost"]:
        for legs in map(int, sys.argv[2:] or ("2", "4")):
            for seconds in (0.05, 0.1, 0.2):
                print(", ".join(f"{key} {value}" for key, value in cost_of(legs, seconds).items()), flush=True)
        return 0
    count, first = (int(one) for one in (*sys.argv[1:3], *("50", "0")[len(sys.argv[1:3]) :]))
    file = Path(sys.argv[3] if len(sys.argv) > 3 else "walking_recovery.csv")
    seen = sys.argv[4] if len(sys.argv) > 4 else "motion"
    append_missing(file, range(first, first + count), lambda seed: row_of(seed, seen))
    said, sound = together(file)
    print(said)
    return int(not sound)


if __name__ == "__main__":
    sys.exit(main())
