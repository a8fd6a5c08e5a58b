"""A part on a pad whose motion a camera saw: the squeeze that makes its way, by a fit, and what the fit says of it."""

from pathlib import Path

import numpy as np

import tarsus as ts
from tarsus.files.rows import parse_rows
from tarsus.fit.verdict import Verdict
from tarsus.validation import RowCase

RATE = 960.0  # pictures a second
READING = 5e-6  # m: heights of a part at rest scatter by a few micrometres from picture to picture
SQUEEZE = "robot.drives.squeeze.law.offset"
LEAST, MOST = 1.5, 40.0  # weights of the part: less cannot hold it, more was not tried


def paths(trial):
    """Heights of pad and part from the first picture on [m], each (65,)."""
    table = parse_rows((Path(__file__).parent / "paths.csv").read_text(encoding="utf-8"), "paths.csv")
    if f"part_{trial:g}" not in table.columns:
        raise ts.InputError(f"paths.csv has no trial {trial:g}")
    return tuple(np.array([1e-6 * float(row[f"{name}_{trial:g}"]) for row in table.rows]) for name in ("pad", "part"))


def case(row, device):
    """The squeeze of a trial fitted to the way of its part; the fitted scene is run."""
    pad, part = paths(row["trial"])
    times = np.arange(len(pad)) / RATE
    shift = {"kind": "sampled", "times": times.tolist(), "levels": pad.tolist(), "interpolation": "cubic"}
    moving = ts.with_values(device, {"duration": times[-1], "ground.motion": {"along": {"displacement": shift}}})
    weight = device.robot.structure.mass[1][1] * device.ground.gravity.acceleration

    def off(run):
        """By how much the part's place is computed too high [m]: on the moving pad, less what was seen."""
        return run.states(times).x[1] + pad - part

    bounds = (-MOST * weight, -LEAST * weight)
    found = ts.fit(moving, {SQUEEZE: bounds}, lambda run: off(run) / READING)
    (range_,) = found.ranges
    low, high = -range_.high / weight, -range_.low / weight
    missed = range_.verdict is Verdict.DETERMINED and not low <= row["squeeze_weights"] <= high

    def read(run):
        error = off(run)
        return {
            "squeeze_weights": -found.values[SQUEEZE] / weight,
            "way_um": float(part[-1] + error[-1]),
            "path": float(np.mean(np.abs(error))),
            "wrongly_sure": float(missed),
        }

    return RowCase(found.scene, read, {"path": 0.0, "wrongly_sure": 0.0})
