"""A page of every kind that the package writes, each by its verb with as little work as shows all of its parts."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from calibrate.toys import ball_study
from identify.campaigns import session, truth
from modes.test_modal import responses

from scene_files import SCENES
from tarsus.cli import main
from tarsus.records.measurement import Quantity
from walking_devices import CREEPING

__all__ = ["KINDS", "make_page"]

_BALL = "50,1.5,14\n90,1,30\n120,,\n"
_GAIT = (
    "millipede-printed", "--free", "gait.duty,gait.frequency=100Hz:200Hz", "--request", "from_rest=10 ms",
    "--request", "candidates=64",
)  # fmt: skip
_GROUNDS = ("--over", "ground.friction.coefficient=4:12")
_BOX = ("--over", "robot.feet.tip.gap=69um:71um", "--over", "ground.restitution.coefficient=0.2:0.5")
_YIELD = (
    "--scatter", "robot.drives.*.law.gain=10%", "--scatter", "ground.friction.coefficient=0.3:0.5",
    "--scatter", "dead=0:1", "--require", "mean_speed", "--require", "foot_slip", "--count", "64:8",
    "--set", "duration=60 ms",
)  # fmt: skip
_STUDY = """scene = "cantilever"
duration = "0.1 s"
measures = ["bounces", "contact_duration"]
[design]
kind = "sobol"
count = 64
seed = 1
[vary]
ground.film.coefficient = { kind = "logspace", start = "0.1e-21 N m^2 s", stop = "10e-21 N m^2 s" }
robot.feet.tip.gap = ["50 um", "60 um", "70 um"]
"""

KINDS = {
    "cantilever": ("simulate", "cantilever"),
    "hexapod": ("simulate", "hexapod"),
    "walker": ("simulate", "hamr-like"),
    "millipede-30": ("simulate", "millipede-30"),
    "explorer": ("explore", "cantilever", "--duration", "60 ms"),
    "sweep": ("sweep", "{study}"),
    "yield": ("yield", CREEPING, *_YIELD),
    "calibrate": ("calibrate", "{ball}"),
    "identify": ("identify", "{campaign}"),
    "track": ("identify", "{first}", "--track", "{second}"),
    "modes": ("modes", "{p1}", "{p2}", "{p3}", "--band", "110Hz:990Hz"),
    "landing": ("design", "landing", "cantilever", "--foot", "tip", "--request", "levels=free=-8V:8V", *_BOX,
                "--set", "robot.drives.pzt.capacitance=664 pF", "--request", "effort=0.03", "--request", "learn=10"),
    "gait": ("design", "gait", *_GAIT, *_GROUNDS, "--request", "look=2"),
    "adapt": ("design", "adapt", *_GAIT, *_GROUNDS, "--request", "hidden=8", "--request", "training=8"),
    "branch": ("branch", SCENES / "impact_oscillator.toml", "--along", "signals.shaker.amplitude=1 V:0.2 V"),
    "attractors": ("attractors", "millipede", "--starts", "6", "--over", "height=0:5um", "--no-edges"),
    "atlas": ("atlas", "cantilever", "--x", "robot.feet.tip.gap=80um:90um", "--y", "signals.pzt.amplitude=4V:6.5V",
              "--depth", "5"),
    "reproduce-cantilever": ("reproduce", "cantilever"),
    "reproduce-hexapod": ("reproduce", "hexapod", "--seeds", "2"),
    "reproduce-millipede": ("reproduce", "millipede"),
}  # fmt: skip
"""Words of the verb that writes each; those in braces are files that `make_page` makes."""


def make_page(kind: str, folder: Path) -> Path:
    """Make the page of a kind, and what it is of, in a folder that is there and empty; the path of the page."""
    files = {"study": folder / "study.toml", "campaign": folder / "campaign"}
    words = [str(word) for word in KINDS[kind]]
    if "{study}" in words:
        files["study"].write_text(_STUDY, encoding="utf-8")
    if "{ball}" in words:
        files["ball"] = ball_study(folder, _BALL, generations=0, leave_out=True)
    if "{campaign}" in words:
        assert main(["synthesize", "cantilever", "-o", str(files["campaign"]), "--seed", "3", "-q"]) == 0
    if "{first}" in words:
        files |= {
            name: session(folder / name, truth(), seed) for seed, name in enumerate(("first", "second"), 11)
        }
    if "{p1}" in words:
        files |= _responses(folder)
    out = folder / ("out.html" if words[0] == "explore" else "out")
    code = main([*(word.format(**files) for word in words), "-o", str(out), "-q"])
    assert code == 0, f"{kind}: {code}"
    pages = (out, out / "report.html", out / "reproduction.html")
    return next(page for page in pages if page.is_file())


def _responses(folder: Path) -> dict[str, Path]:
    """A file of a frequency response of each of three points."""
    frf = responses(Quantity.VELOCITY, 0.001)
    head = "Frequency (Hz),v real (m/s/N),v imag (m/s/N)"
    files = {f"p{k}": folder / f"p{k}.csv" for k in (1, 2, 3)}
    for file, (row,) in zip(files.values(), frf.values, strict=True):
        columns = np.column_stack([frf.frequency, row.real, row.imag])
        np.savetxt(file, columns, delimiter=",", header=head, comments="", fmt="%.12g")
    return files
