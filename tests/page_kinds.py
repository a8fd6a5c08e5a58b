"""A page of every kind that the package writes, made with as little work as shows all of its parts."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

import tarsus as ts
from calibrate.toys import ball_study
from identify.campaigns import identified
from modes.test_modal import responses
from reproduce.coarse_studies import FEW, ringing
from scene_files import SCENES
from tarsus.base.spec import float_paths
from tarsus.cli import main
from tarsus.identify.track import Drift, Tracking, drift_of
from tarsus.records.measurement import Quantity
from tarsus.report.identify_page import identify_html
from tarsus.report.pages import write_page
from tarsus.report.track_page import track_html
from tarsus.report.validation_page import suite_html
from tarsus.validation import Suite
from tarsus_reproduce.index import index_html
from tarsus_reproduce.millipede import judge_scene
from tarsus_reproduce.millipede_tables import millipede_reproduction
from validation.folders import drop_folder
from walking_devices import CREEPING

__all__ = ["KINDS", "Kind"]

_BALL = "50,1.5,14\n90,1,30\n120,,\n"
_GAIT = (
    "millipede-printed --free gait.duty,gait.frequency=100Hz:200Hz --over ground.friction.coefficient=4:12"
    " --request from_rest=10ms --request candidates=64"
)
_BOX = "--over robot.feet.tip.gap=69um:71um --over ground.restitution.coefficient=0.2:0.5"
_LANDING = (
    "--foot tip --request levels=free=-8V:8V --set robot.drives.pzt.capacitance=664pF"
    " --request effort=0.01 --request learn=2"
)
_YIELD = (
    "--scatter robot.drives.*.law.gain=10% --over ground.friction.coefficient=0.3:0.5 --dead 0:1"
    " --require mean_speed --require foot_slip --robots 64 --draws 8 --set duration=60ms"
)
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


@dataclass(frozen=True)
class Kind:
    """A kind of page: the file of its sections, and what makes one in a folder that is there and empty; the path of
    the page."""

    source: str
    make: Callable[[Path], Path]


def verb(line: str, **files: Callable[[Path], Path]) -> Callable[[Path], Path]:
    """A command line that writes a page. files: what makes those that are named in braces."""

    def make(folder: Path) -> Path:
        own = {name: made(folder) for name, made in files.items()}
        words = [word.format(**own) for word in line.split()]
        out = folder / ("out.html" if words[0] == "explore" else "out")
        code = main([*words, "-o", str(out), "-q"])
        assert code == 0, f"{line}: {code}"
        return next(page for page in (out, out / "report.html", out / "reproduction.html") if page.is_file())

    return make


def _study(folder: Path) -> Path:
    (folder / "study.toml").write_text(_STUDY, encoding="utf-8")
    return folder / "study.toml"


def _ball(folder: Path) -> Path:
    return ball_study(folder, _BALL, generations=0, leave_out=True)


def _response(point: int) -> Callable[[Path], Path]:
    """A file of the frequency response of one of three points."""

    def make(folder: Path) -> Path:
        frf, file = responses(Quantity.VELOCITY, 0.001), folder / f"p{point}.csv"
        (row,) = frf.values[point - 1]
        head = "Frequency (Hz),v real (m/s/N),v imag (m/s/N)"
        columns = np.column_stack([frf.frequency, row.real, row.imag])
        np.savetxt(file, columns, delimiter=",", header=head, comments="", fmt="%.12g")
        return file

    return make


def _identification(folder: Path) -> Path:
    return write_page(identify_html(identified()), folder / "report.html")


def _series(folder: Path) -> Path:
    """Four campaigns that found the same within their errors, but for one number of the last."""
    found = identified()
    known = float_paths(found.model.scene)
    drifts: list[Drift] = []
    for step in found.steps.values():
        for path in step.paths:
            low, high = step.interval(path)
            error = 0.25 * (high - low)
            if not (np.isfinite(error) and error > 0.0):
                continue
            values = step.value(path) + error * np.array([0.0, 0.4, -0.3, 0.1 if drifts else 9.0])
            errors = np.full(4, error)
            drifts.append(Drift(path, known[path].unit, values, errors, *drift_of(values, errors, 100)))
    series = Tracking(("may", "june", "july", "august"), (found,) * 4, tuple(drifts))
    assert len(series.alarms) == 1
    return write_page(track_html(series), folder / "report.html")


def _trends(folder: Path) -> Path:
    """Of one reading of the text, over few values."""
    judged = judge_scene("ringing", ringing(), coarse=FEW, duration=0.04)
    return write_page(millipede_reproduction((judged,)).html(), folder / "reproduction.html")


def _index(folder: Path) -> Path:
    """Of one reproduction."""
    return write_page(index_html({"quadruped": "Device quadruped"}), folder / "index.html")


def _validations(folder: Path) -> Path:
    """Of one experiment."""
    return write_page(suite_html(Suite({"mems-switch": ts.validate("mems-switch")})), folder / "index.html")


_RESPONSES = {f"p{point}": _response(point) for point in (1, 2, 3)}
KINDS = {
    "cantilever": Kind("run_page.py", verb("simulate cantilever")),
    "hexapod": Kind("run_page.py", verb("simulate hexapod")),
    "walker": Kind("run_page.py", verb("simulate hamr-like")),
    "turning": Kind("run_page.py", verb("simulate turning-hexapod")),
    "millipede-30": Kind("run_page.py", verb("simulate millipede-30")),
    "explorer": Kind("explorer.py", verb("explore cantilever --duration 60ms")),
    "explorer-walker": Kind("explorer.py", verb("explore millipede --duration 60ms")),
    "explorer-hexapod": Kind("explorer.py", verb("explore hexapod-walker --duration 60ms")),
    "sweep": Kind("sweep_page.py", verb("sweep {study}", study=_study)),
    "yield": Kind("yield_page.py", verb(f"yield {CREEPING} {_YIELD}")),
    "calibrate": Kind("calibrate_page.py", verb("calibrate {ball}", ball=_ball)),
    "identify": Kind("identify_page.py", _identification),
    "track": Kind("track_page.py", _series),
    "modes": Kind("modes_page.py", verb("modes {p1} {p2} {p3} --band 110Hz:990Hz", **_RESPONSES)),
    "landing": Kind("landing_page.py", verb(f"design landing cantilever {_LANDING} {_BOX}")),
    "gait": Kind("gait_page.py", verb(f"design gait {_GAIT} --request look=2")),
    "adapt": Kind("gait_page.py", verb(f"design adapt {_GAIT} --request hidden=8 --request training=8")),
    "branch": Kind(
        "branch_page.py", verb(f"branch {SCENES}/impact_oscillator.toml --along signals.shaker.amplitude=1V:0.2V")
    ),
    "attractors": Kind("attractors_page.py", verb("attractors millipede --starts 6 --over height=0:5um --no-edges")),
    "atlas": Kind(
        "atlas_page.py",
        verb("atlas cantilever --x robot.feet.tip.gap=80um:90um --y signals.pzt.amplitude=4V:6.5V --depth 5"),
    ),
    "validate": Kind("validation_page.py", verb("validate {drops}", drops=drop_folder)),
    "validations": Kind("validation_page.py", _validations),
    "reproduce-cantilever": Kind("tarsus_reproduce:reproduction.py", verb("reproduce cantilever")),
    "reproduce-hexapod": Kind("tarsus_reproduce:reproduction.py", verb("reproduce hexapod --seeds 2")),
    "reproduce-millipede": Kind("tarsus_reproduce:reproduction.py", _trends),
    "index": Kind("tarsus_reproduce:index.py", _index),
}
"""Every kind of page, a row each."""
