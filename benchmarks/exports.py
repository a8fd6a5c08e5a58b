"""What is lost when devices are carried to MuJoCo: the numbers of `tarsus export`, one row a device.

pip install "tarsus[mujoco]"
python benchmarks/exports.py cantilever quadruped hexapod millipede
"""

from __future__ import annotations

import sys

import tarsus as ts
from tarsus.export.mjcf import Mjcf
from tarsus.export.mujoco_run import loss
from tarsus.export.subject import Subject


def main() -> None:
    for name in sys.argv[1:] or (
        "cantilever",
        "ball-on-table",
        "quadruped",
        "hexapod",
        "millipede",
        "hamr-like",
    ):
        scene = ts.load_scene(name)
        print(loss(Mjcf(Subject.of(scene, scene.duration))).text(), flush=True)


if __name__ == "__main__":
    main()
