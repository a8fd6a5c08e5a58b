"""Command lines of the documentation, run as they are printed, page by page in a folder where nothing is yet.

Those of Tarsus run in this process, which has loaded it; what is for a shell is run by one.
"""

from __future__ import annotations

import os
import re
import shlex
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

from calibrate.toys import ball_study
from doc_pages import PAGES, ROOT, sweep_study
from identify.campaigns import of_known_structure
from tarsus.cli import main

NOT_RUN = re.compile(
    r"git clone|python3 -m venv|pip install|\.venv/bin/|jupyter |tarsus open|.*tcp://|qsub |tarsus explore"
)
"""Lines that install, open a window, or need a cluster or the engine for pages: `.ci/run`, tests/cluster and
tests/core/test_page_engine.py do those."""

SMALLER = {
    "candidates=400 -o gaits": "candidates=64 --request look=2 --request from_rest=50ms -o gaits",
    "sense=slip -o": "sense=slip --request candidates=64 --request hidden=2 --request training=2"
    " --request from_rest=50ms -o",
    "objective=speed,transport -o gaits": "objective=speed,transport --request from_rest=50ms"
    " --request candidates=64 --request look=2 -o gaits",
    "from_rest=100ms": "from_rest=50ms",
    "candidates=72 --request look=24 -o faster": "candidates=64 --request look=2 -o faster",
    'um/s" -o out': 'um/s" --robots 4 --draws 2 --from-rest 50ms -o out',
    'adhesion.rate --budget "2 s"': 'adhesion.rate --budget "2 s" --vary hz=50',
    'hz="15, 50, 100" --vary gap="70 um, 90 um"': 'hz=50 --vary gap="70 um"',
    'recommend millipede --budget "1 s"': 'recommend millipede --budget "0.3 s" --vary hz=102 --vary volts=14',
    "--starts 60 --over": "--starts 20 --over",
    "--starts 20 --over": "--starts 20 --no-edges --over",
    "--over robot.structure.frequencies.0=617Hz:629Hz --over robot.structure.frequencies.1=6360Hz:6488Hz ": "",
    "=0.15:0.5 -o landing": "=0.15:0.5 --request effort=0.005 --request risk=nominal -o landing",
    "effort=0.3 -o landing": "effort=0.005 --request risk=nominal -o again",
    "tarsus calibrate cantilever -o fit": "tarsus devices",
    ' --array 100 --sbatch "--partition=main --time=2:00:00 --cpus-per-task=8"': " --array 4",
    ' --array 100 --sbatch "--partition=main --time=2:00:00"': " --array 4",
    "-o /shared/out --array 100": "-o another --array 3",
    "/shared/out/array": "another/array",
    "seq 0 99": "seq 0 2",
    "identify june --track july august": "identify june --track june",
    "identify lab/campaign.toml -o result": "identify lab -o result",
    "identify walks -o found": "check walks",
    "validate --all -o pages": "validate ball-on-table -o pages",
    "0:5um -o gaits": "0:5um -o out",
    "shortest=1us -o soft": "shortest=1us --request effort=0.005 -o soft",
    "reproduce hexapod -o hexapod": "reproduce hexapod --seeds 2 -o hexapod",
    "/shared/out": "shared",
    "identified/identified.toml": "cantilever",
    "# what is left to say: exit code 2 until it is said": "&& exit 1 || [ $? -eq 2 ]",
}
"""What would take minutes, asked for in small; folders that a page does not make."""


def nothing(folder: Path) -> None:
    """Nothing is there."""


def examples(folder: Path) -> None:
    (folder / "examples").symlink_to(ROOT / "examples")


def sessions(folder: Path) -> None:
    """A small campaign to be compared with."""
    of_known_structure(folder / "june")


def table_study(folder: Path) -> None:
    """A study of a table as small as they come, by the name that the page gives it."""
    file = ball_study(folder, "50,1.5,14\n90,1,30\n120,,\n", generations=0, leave_out=False)
    Path(file).rename(folder / "my-study.py")


def request(folder: Path) -> None:
    """The request of the page of landings, by the name that the page gives it."""
    (text,) = re.findall(r"```toml\n(.*?)```", PAGES["landing.md"], re.DOTALL)
    (folder / "soft.toml").write_text(text, encoding="utf-8")


HERE: dict[str, tuple[Callable[[Path], None], tuple[str, ...]]] = {
    "CONTRIBUTING.md": (examples, ("out/report.html",)),
    "add-a-law.md": (examples, ("out/report.html", "pulled/report.html")),
    "agreement.md": (nothing, ()),
    "attractors.md": (nothing, ("out/attractors.json", "out/attractor-3.toml")),
    "calibrate.md": (table_study, ("out/calibration.json", "out/branch-1.toml")),
    "determined.md": (nothing, ()),
    "export.md": (nothing, ("mujoco/model.xml", "matlab/run_model.m", "firmware/gait.h")),
    "gaits.md": (nothing, ("gaits/gait.h", "adaptive/adapt.json")),
    "gallery.md": (nothing, ("out/report.html", "hexapod/reproduction.html")),
    "identify.md": (sessions, ("result/identified.toml",)),
    "identify-walking.md": (examples, ("found/identified.toml", "found/draws.npz")),
    "install.md": (nothing, ("mine/report.html", "result/identified.toml", "own/campaign.toml")),
    "landing.md": (request, ("landing/landing.h",)),
    "scale.md": (sweep_study, ("out/sweep.nc", "shared/array/1.sh", "another/sweep.nc")),
    "sweeps.md": (sweep_study, ("out/sweep.nc", "mine/sweep.nc")),
    "tutorial-gait.md": (nothing, ("gaits/gait.h",)),
    "tutorial-landing.md": (nothing, ("soft/landing.h",)),
    "tutorial-transfer.md": (nothing, ("found/draws.npz", "faster/gait.h")),
    "tutorial-two-robots.md": (nothing, ("out/attractors.json", "out/attractor-3.html")),
    "validation.md": (nothing, ("drop/report.html", "pages/report.html")),
    "walking.md": (nothing, ("walker.toml", "walk/report.html")),
    "yield.md": (nothing, ("out/yield.json",)),
}
"""What a page's lines need, and files that must be there afterwards."""


PRINTED = re.compile(r"^([a-z]+(?:\.\w+)+) +(\S+) .* [\d.]+ % +(\w+)(?: !)?$", re.MULTILINE)
"""Rows of an identification as its page prints them: path, value, verdict."""


def lines(page: str) -> list[str]:
    """Command lines of a page that are run, in small."""
    found = []
    for block in re.findall(r"^```(?:bash|sh|console)\n(.*?)^```", PAGES[page], re.DOTALL | re.MULTILINE):
        for line in re.sub(r"\\\n\s*", "", block).splitlines():
            if line.strip() and not NOT_RUN.match(line):
                for whole, small in SMALLER.items():
                    line = line.replace(whole, small)
                found.append(re.sub(r"\s+#.*", "", line))
    return found


def test_every_page_with_command_lines_is_run():
    assert len(PRINTED.findall(PAGES["identify.md"])) == 5
    assert {page for page in PAGES if lines(page)} == set(HERE)
    printed = "\n".join(re.sub(r"\\\n\s*", "", text) for text in PAGES.values())
    assert [whole for whole in SMALLER if whole not in printed] == []


AFTER = {
    "install.md": "identify.md",
    "tutorial-transfer.md": "identify-walking.md",
    "tutorial-two-robots.md": "attractors.md",
}
"""Pages that are run in the folder of another one after it: lines that both have are run once."""


def ran(line: str, capsys: pytest.CaptureFixture[str]) -> str:
    """What a line of a page prints; it must succeed."""
    if line.startswith("tarsus ") and not re.search("[|&;<>$]", line):
        code, (out, err) = main(shlex.split(line)[1:]), capsys.readouterr()
    else:
        done = subprocess.run(["bash", "-ec", line], capture_output=True, text=True, timeout=900, check=False)
        code, out, err = done.returncode, done.stdout, done.stderr
    assert code == 0, f"{line}\n{out[-2000:]}\n{err[-2000:]}"
    return out


# Slow: designs, studies, a campaign. That all are command lines is seen by test_docs.py.
@pytest.mark.full
@pytest.mark.parametrize("page", [page for page in HERE if page not in AFTER])
def test_the_command_lines_of_a_page_run(page, tmp_path, monkeypatch, capsys):
    pages = [page, *(one for one, before in AFTER.items() if before == page)]
    for one in pages:
        HERE[one][0](tmp_path)
    programs = tmp_path / "programs"
    programs.mkdir()
    (programs / "tarsus").write_text(f'#!/bin/sh\nexec "{sys.executable}" -m tarsus "$@"\n', encoding="utf-8")
    (programs / "tarsus").chmod(0o755)
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("PATH", f"{programs}{os.pathsep}{os.environ['PATH']}")
    monkeypatch.setenv("BROWSER", "true")
    printed = "".join(ran(line, capsys) for line in dict.fromkeys(line for one in pages for line in lines(one)))
    assert [name for one in pages for name in HERE[one][1] if not (tmp_path / name).is_file()] == []
    for path, value, verdict in PRINTED.findall(PAGES[page]):
        row = next(row for row in PRINTED.findall(printed) if row[0] == path)  # a series follows
        assert float(row[1].split("·")[0]) == pytest.approx(float(value.split("·")[0]), rel=0.02), path
        assert row[2] == verdict, path
