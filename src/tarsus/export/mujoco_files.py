"""What is written for MuJoCo: the model, its drives, a script that runs it, and its loss where it can be measured."""

from __future__ import annotations

import csv
import io
from importlib.resources import files
from importlib.util import find_spec

from tarsus.base.errors import InputError
from tarsus.export.mjcf import Mjcf
from tarsus.export.subject import Subject
from tarsus.export.verb import Exported
from tarsus.files.jsontext import json_text
from tarsus.tables.table import Table


def exported(described: Subject, step: float | None) -> Exported:
    """The files of a scene; step [s]: MuJoCo's. Raises InputError for a robot without feet or of too many, and where
    MuJoCo refuses the model."""
    if not described.feet:
        raise InputError("mjcf: the robot has no foot that could touch the ground")
    mjcf = Mjcf(described, step)
    units = mjcf.units
    own = {"length_m": units.length, "mass_kg": units.mass, "time_s": units.time, "force_N": units.force}
    out = {
        "model.xml": mjcf.text(),
        "units.json": json_text(own) + "\n",
        "drives.csv": drives_csv(described),
        "run_model.py": (files("tarsus.export") / "run_model.py").read_text(encoding="utf-8"),
    }
    lost, measured = mjcf.lost, None
    found = find_spec("mujoco")
    if found is None or found.origin is None:  # a folder of that name, such as this one writes, is no package
        lost = [*lost, "the loss was not measured: MuJoCo is not installed (pip install mujoco)"]
    else:
        from tarsus.export.mujoco_run import loss

        measured = loss(mjcf)
    out["loss.txt"] = _text(measured, lost)
    out["loss.json"] = json_text({"measured": measured.json() if measured else None, "lost": lost}) + "\n"
    return Exported(out, tuple(lost), measured)


def _text(measured: Table | None, lost: list[str]) -> str:
    said = "\n".join(f"- {one}" for one in lost)
    return ("" if measured is None else f"{measured.text()}\n\n") + f"without a counterpart:\n{said}\n"


def drives_csv(described: Subject) -> str:
    """Forces of the drives over time, straight lines between rows."""
    times, values = described.drive_table(described.run.duration)
    out = io.StringIO()
    rows = csv.writer(out, lineterminator="\n")
    rows.writerow(["time [s]", *(f"{name} [N]" for name in described.drives)])
    rows.writerows([repr(float(x)) for x in (time, *row)] for time, row in zip(times, values, strict=True))
    return out.getvalue()
