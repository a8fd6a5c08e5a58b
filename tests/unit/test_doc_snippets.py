"""Every piece of Python in the documentation runs, and every command line in it is one."""

from __future__ import annotations

import re
import shlex
import sys
from collections.abc import Callable
from importlib.util import find_spec
from pathlib import Path
from types import ModuleType
from typing import Any

import doc_pages
import numpy as np
import pytest
import xarray
from doc_pages import ROOT

import tarsus as ts

PAGES = doc_pages.PAGES | {"README.md": (ROOT / "README.md").read_text(encoding="utf-8")}

ELSEWHERE = {
    "README.md": "examples/test_examples.py",
    "CONTRIBUTING.md": "lint/test_repository.py",  # the law of the examples, which they run
    "calibrate.md": "unit/calibrate/test_calibrating.py",
    **dict.fromkeys(
        (
            "batches.md", "fit.md", "gaits.md", "install.md", "landing.md", "orbits.md", "slots.md", "theory.md",
            "tutorial-gait.md", "tutorial-landing.md",
        ),
        "unit/test_docs.py",
    ),
}  # fmt: skip
"""Pages whose Python other tests run."""


def blocks(page: str) -> list[str]:
    return re.findall(r"^```python\n(.*?)^```", PAGES[page], re.DOTALL | re.MULTILINE)


def lab(folder: Path) -> dict[str, Any]:
    """The campaign of the page of identification: small, but whole."""
    from tarsus.synthesis.campaign_folder import write_campaign
    from tarsus.synthesis.recordings import Instrument

    write_campaign(ts.load_scene("cantilever"), folder / "lab", Instrument(rate=20e3, snr_db=50.0), 1)
    return {}


def records(folder: Path) -> dict[str, Any]:
    """Files as the page of readers names them: a table of a leg, and frequency responses in MATLAB's format."""
    from scipy.io import savemat

    time = np.arange(200) * 1e-4
    rows = np.column_stack([time, np.sin(300.0 * time), 8.0 * np.sign(np.cos(300.0 * time))])
    text = "t [s],Ch1,Ch2\n" + "\n".join(",".join(f"{x:.9g}" for x in row) for row in rows)
    (folder / "leg.csv").write_text(text)
    line = np.arange(1, 65) * 0.3125
    response = 1.0 / (10.0**2 - line**2 + 0.5j * line)
    savemat(folder / "leg.mat", {"H": response})
    savemat(folder / "h.mat", {"frequency": line, "Hre": response.real, "Him": response.imag})
    cells = np.column_stack([line, np.abs(response), np.degrees(np.angle(response))])
    text = "frequency [Hz],mag,arg\n" + "\n".join(",".join(f"{x:.9g}" for x in row) for row in cells)
    (folder / "h.csv").write_text(text)
    return {}


def plate(folder: Path) -> dict[str, Any]:
    """Responses of two modes at three points, as a universal file."""
    import pyuff

    hertz = np.arange(100.0, 1500.0, 1.0)
    poles = [(400.0, 0.01), (900.0, 0.008)]
    shapes = np.array([[1.0, 0.7, -0.4], [0.5, -0.8, 1.0]])
    sets = []
    for point in range(3):
        value = sum(
            shapes[k, point] * shapes[k, 0] / (f**2 - hertz**2 + 2j * d * f * hertz)
            for k, (f, d) in enumerate(poles)
        ) * -((2.0 * np.pi * hertz) ** 2)
        sets.append(
            pyuff.prepare_58(
                binary=0, func_type=4, rsp_node=point + 1, rsp_dir=3, ref_dir=3, ref_node=1, data=value, x=hertz,
                id1=f"point {point + 1}", rsp_ent_name="NONE", ref_ent_name="NONE", abscissa_spacing=1,
                abscissa_spec_data_type=18, ordinate_spec_data_type=12, orddenom_spec_data_type=13,
            )
        )  # fmt: skip
    pyuff.UFF(str(folder / "plate.uff")).write_sets(sets, mode="add")
    return {}


def gradients(folder: Path) -> dict[str, Any]:
    paths = ["ground.film.coefficient", "robot.feet.tip.gap"]
    vary = {"robot.feet.tip.gap": [69e-6, 70e-6]}
    scene = ts.load_scene("cantilever")
    return {"ts": ts, "scene": scene, "times": [1e-3, 2e-3], "paths": paths, "vary": vary}


def determined(folder: Path) -> dict[str, Any]:
    draws = np.random.default_rng(1).normal([2.0, 5.0], [0.1, 0.2], (400, 2))
    return {"names": ["a", "b"], "values": [2.0, 5.0], "draws": draws, "units": {"a": "m", "b": "s"}}


def missing(text: str) -> bool:
    """Whether a block is of a library that Tarsus does not bring and that is not installed."""
    return any(
        re.search(rf"^import {name}$", text, re.MULTILINE) and find_spec(name) is None
        for name in ("torch", "jax", "gymnasium")
    )


def nothing(folder: Path) -> dict[str, Any]:
    return {}


def cluster(folder: Path) -> dict[str, Any]:
    """A study, and a cluster of one thread here in place of the one that dask-jobqueue would start."""
    distributed = pytest.importorskip("distributed")
    doc_pages.sweep_study(folder)

    class SLURMCluster(distributed.LocalCluster):
        def __init__(self, cores: int, memory: str, walltime: str) -> None:
            super().__init__(n_workers=1, threads_per_worker=1, processes=False, dashboard_address=None)

        def adapt(self, maximum_jobs: int) -> None:
            """It has what it has."""

    sys.modules["dask_jobqueue"] = ModuleType("dask_jobqueue")
    sys.modules["dask_jobqueue"].__dict__["SLURMCluster"] = SLURMCluster
    return {}


def law(folder: Path) -> dict[str, Any]:
    (folder / "examples").symlink_to(ROOT / "examples")
    return {}


def restitution(names: dict[str, Any]) -> None:
    assert np.isfinite(names["found"].restitution.value)


def modes(names: dict[str, Any]) -> None:
    assert [round(mode.frequency.value) for mode in names["fit"].modes] == [400, 900]


def files(names: dict[str, Any]) -> None:
    assert names["record"].count == 200 and names["record"].drive == "Ch2"
    assert len(names["response"].frequency) == 64


def runs(names: dict[str, Any]) -> None:
    assert names["run"].ok


def leg(names: dict[str, Any]) -> None:
    assert names["motion"].closure < 1e-6


def swept(names: dict[str, Any]) -> None:
    assert names["result"].runs == 11


def tooth(names: dict[str, Any]) -> None:
    wave = names["Tooth"](top="8 V", half="10 ms")
    assert wave.volts(np.array([0.005, 0.01, 0.025])) == pytest.approx([4.0, 8.0, 4.0])


def identified(names: dict[str, Any]) -> None:
    low, high = names["found"].steps["adhesion"].interval("ground.adhesion.rate")
    assert 0.0 < low < high
    assert "hysteresis" in names["chain"].steps


def spread(names: dict[str, Any]) -> None:
    del sys.modules["dask_jobqueue"]
    names["cluster"].close()
    assert xarray.open_dataset("out/sweep.nc").sizes["ground.adhesion.rate"] == 2


def learned(names: dict[str, Any]) -> None:
    """The derivative against differences, and an episode of the environment where Gymnasium is installed."""
    value, slopes = names["value_and_slopes"]([8.0, 0.5])
    ahead, behind = (names["value_and_slopes"]([8.0 + step, 0.5])[0] for step in (1e-4, -1e-4))
    assert value > 0.0 and slopes[0] == pytest.approx((ahead - behind) / 2e-4, rel=1e-4)
    if "torch" in names:
        assert names["values"].grad.tolist() == pytest.approx(slopes)
    if "jax" in names:
        found = names["jax"].grad(names["hardest_impact"])(names["jnp"].array([8.0, 0.5]))
        assert found.tolist() == pytest.approx(slopes)
    if "Touchdown" in names:
        world = names["Touchdown"]()
        first, _ = world.reset(seed=1)
        ends = [world.step(np.array([volts]))[3] for volts in [8.0, -8.0] * 10]
        assert first.tolist() == [1.0, 0.0] and ends == [False] * 19 + [True]


def passed(names: dict[str, Any]) -> None:
    """That it ran is all there is to see."""


Case = tuple[Callable[[Path], dict[str, Any]], Callable[[dict[str, Any]], None], str]
HERE: dict[str, Case] = {
    "add-a-law.md": (law, runs, ""),
    "determined.md": (determined, passed, ""),
    "experiment.md": (nothing, restitution, "slow"),
    "extending.md": (nothing, tooth, ""),
    "files-in.md": (records, files, ""),
    "gradients.md": (gradients, runs, ""),
    "identify.md": (lab, identified, "slow"),
    "index.md": (nothing, runs, ""),
    "learning.md": (nothing, learned, ""),
    "legs.md": (nothing, leg, ""),
    "modal.md": (plate, modes, ""),
    "scale.md": (cluster, spread, "slow"),
    "sweeps.md": (nothing, swept, ""),
    "walking.md": (nothing, runs, ""),
}
"""What a page's Python needs, what must hold afterwards, and whether it takes more than some seconds."""


def test_every_page_with_python_is_run():
    written = {page for page in PAGES if blocks(page)}
    assert written == {*HERE, *ELSEWHERE}
    for page, test in ELSEWHERE.items():
        assert page in (ROOT / "tests" / test).read_text(encoding="utf-8"), page


@pytest.mark.parametrize(
    "page",
    [pytest.param(page, marks=[pytest.mark.slow] if mark else []) for page, (_, _, mark) in HERE.items()],
)
def test_the_python_of_a_page_runs(page, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    prepare, check, _ = HERE[page]
    names = prepare(tmp_path)
    own = blocks(page)
    for text in (
        reversed(own) if page == "sweeps.md" else own
    ):  # which shows how to read a sweep before it makes one
        if not missing(text):
            exec(compile(text, page, "exec", dont_inherit=True), names)
    check(names)


def command_lines() -> list[tuple[str, str]]:
    """Every command line of Tarsus in a block for the shell, and in the tables of the README."""
    found = []
    for page, text in sorted(PAGES.items()):
        for block in re.findall(r"^```bash\n(.*?)^```", text, re.DOTALL | re.MULTILINE):
            lines = block.replace("\\\n", " ").splitlines()
            found += [(page, line.removeprefix(".venv/bin/")) for line in lines]
        found += [(page, line) for line in re.findall(r"^\| `(tarsus [^`]+)` \|", text, re.MULTILINE)]
    return [(page, line) for page, line in found if line.startswith("tarsus ")]


def test_every_command_line_is_one():
    from tarsus.cli.app import RENAMED, VOICES, build

    known = build([])
    lines = command_lines()
    assert len(lines) > 40
    for page, line in lines:
        words = [word for word in shlex.split(line, comments=True)[1:] if word not in VOICES]
        words[0] = RENAMED.get(words[0], words[0])
        try:
            known.parse_args(words, print_error=False, exit_on_error=False)
        except Exception as error:
            pytest.fail(f"{page}: {line}: {error}")
