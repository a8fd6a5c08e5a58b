# pyright: reportAttributeAccessIssue=false
"""Run model.xml with the forces of drives.csv, and print when feet touch the ground: needs mujoco and numpy alone.

python run_model.py [seconds]
"""

import csv
import json
import sys
from pathlib import Path

import mujoco  # type: ignore[import]
import numpy as np

here = Path(__file__).parent
units = json.loads((here / "units.json").read_text(encoding="utf-8"))
model = mujoco.MjModel.from_xml_path(str(here / "model.xml"))
data = mujoco.MjData(model)
mujoco.mj_resetDataKeyframe(model, data, 0)
with (here / "drives.csv").open(encoding="utf-8", newline="") as file:
    rows = [[float(x) for x in row] for row in list(csv.reader(file))[1:]]
table = np.array(rows)
drives = [i for i in range(model.nu) if model.actuator(i).name.startswith("drive:")]
feet = [model.geom(i) for i in range(model.ngeom) if model.geom(i).name.startswith("foot:")]
end = float(sys.argv[1]) if len(sys.argv) > 1 else float(table[-1, 0])
touching = np.ones(len(feet), dtype=bool)
while data.time * units["time_s"] < end:
    now = data.time * units["time_s"]
    for column, i in enumerate(drives):
        data.ctrl[i] = np.interp(now, table[:, 0], table[:, 1 + column]) / units["force_N"]
    mujoco.mj_step(model, data)
    down = np.zeros(len(feet), dtype=bool)
    for contact in data.contact:
        down |= np.array([geom.id in contact.geom and contact.dist <= 0.0 for geom in feet])
    for geom in (feet[k] for k in np.flatnonzero(down & ~touching)):
        print(f"{now:.9g} s: {geom.name.removeprefix('foot:')}")
    touching = down
