"""The moving picture at the top of the README: thirty legs, one period of their drives."""

import sys

import tarsus as ts

run = ts.simulate("millipede-30", "0.2 s")
path = ts.movie(run, sys.argv[1] if len(sys.argv) > 1 else "walk.gif", width=640, periods=1)
speed = float(run.measures["mean_speed"].value)
print(f"{path}: {path.stat().st_size // 1000} kB; the robot walks at {1e3 * speed:.2f} mm/s")
