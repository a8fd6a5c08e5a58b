"""Files and calls printed in the documentation work as printed."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

DOCS = Path(__file__).parents[2] / "docs"


def test_the_scene_on_the_file_format_page_is_one():
    from tarsus.files.toml import parse_scene

    page = (DOCS / "file-format.md").read_text(encoding="utf-8")
    (text,) = re.findall(r"```toml\n(.*?)```", page, re.DOTALL)
    scene = parse_scene(text)
    assert scene.robot.feet["tip"].gap == 70e-6
    assert scene.origin("robot.feet.tip.gap").source.value == "printed"


def test_the_grid_on_the_page_of_batches_runs():
    page = (DOCS / "batches.md").read_text(encoding="utf-8")
    (text,) = re.findall(r"```python\n(.*?)```", page, re.DOTALL)
    names: dict = {}
    exec(text, names)
    assert names["contact"].shape == (5, 3) and np.isfinite(names["contact"]).all()
    assert names["data"]["peak"].dims == ("ground.film.coefficient", "signals.pzt.amplitude")


def test_the_session_on_the_page_of_slots_runs():
    page = (DOCS / "slots.md").read_text(encoding="utf-8")
    (text,) = re.findall(r"```python\n(.*?)```", page, re.DOTALL)
    names: dict = {}
    exec(text, names)
    assert names["first"].ok and names["second"].scene.robot.feet["tip"].gap == 65e-6
    assert names["second"].motion.log.book.native is names["first"].motion.log.book.native
    assert len(names["batch"]) == 3
    slots = names["session"].slots
    assert {"robot.feet.tip.gap", "signals.pzt.phase", "ground.film.coefficient"} <= set(slots)


def test_the_orbits_on_the_page_of_periodic_motion_are_found():
    page = (DOCS / "orbits.md").read_text(encoding="utf-8")
    text, walking = re.findall(r"```python\n(.*?)```", page, re.DOTALL)
    names: dict = {}
    exec(text, names)
    assert (
        names["orbit"].kind == "stable, period 1, 4 impacts, 1 of them held" and names["orbit"].kind in text
    )
    assert np.abs(names["orbit"].multipliers).max() < 1e-9
    exec(walking, names)
    assert names["gait"].kind in walking and names["gait"].travel == pytest.approx(1.539e-6, rel=1e-3)


def test_the_fit_on_the_page_of_fits_finds_the_device():
    page = (DOCS / "fit.md").read_text(encoding="utf-8")
    (text,) = re.findall(r"```python\n(.*?)```", page, re.DOTALL)
    names: dict = {}
    exec(text, names)
    found, problem = names["found"], names["problem"]
    assert found.values["robot.feet.tip.gap"] == pytest.approx(70e-6, rel=1e-6)
    assert found.values["ground.restitution.coefficient"] == pytest.approx(
        problem.scene.ground.restitution.coefficient, rel=1e-4
    )
    assert found.values["ground.film.coefficient"] == pytest.approx(1.747e-21, rel=1e-3)
    assert found.evaluations < 10 and not problem.flags(found.x)


def test_the_design_on_the_page_of_soft_landings_runs():
    page = (DOCS / "landing.md").read_text(encoding="utf-8")
    (text,) = re.findall(r"```python\n(.*?)```", page, re.DOTALL)
    names: dict = {}
    exec(text, names)
    assert names["softer"] < 0.5 and names["plain"] == pytest.approx(0.557, abs=1e-3)
    assert "LANDING_COUNT" in names["header"]


def snippets(page: str, count: int | None = None) -> dict:
    """Names after the Python of a page, its first ``count`` blocks or all, has run from top to bottom."""
    import matplotlib

    matplotlib.use("Agg")
    names: dict = {}
    for text in re.findall(r"```python\n(.*?)```", (DOCS / page).read_text(encoding="utf-8"), re.DOTALL)[
        :count
    ]:
        exec(text, names)
    return names


def test_the_numbers_on_the_page_of_theory_are_those_of_the_engine():
    names = snippets("theory.md")
    assert names["moved"] == pytest.approx(names["landing"] / 2.0, rel=1e-10)
    assert names["found"] == pytest.approx(names["exact"], rel=1e-10)
    assert names["row"] == pytest.approx(names["exact"][0], rel=1e-10)
    assert names["drops"] == pytest.approx(0.81)
    assert np.abs(names["orbit"].multipliers).max() < 1e-9 and names["orbit"].stable
    assert names["half"] == pytest.approx(0.6) and names["least"] == pytest.approx(0.6)


def test_the_tutorial_of_the_switch_runs():
    names = snippets("tutorial-landing.md", 4)
    assert names["closing"]["time"] == pytest.approx(27.795e-6, abs=0.5e-9)
    account = names["account"]
    assert -account.impacts / account.laws["electrostatic"] == pytest.approx(-1.0 / 3.0, abs=0.04)
    design = names["design"]
    assert design.speed < 0.233 / 20.0
    assert design.signal.durations[:2] == pytest.approx((26.23e-6, 3.8e-6), abs=0.2e-6)


@pytest.mark.slow
def test_the_tutorial_of_the_switch_runs_to_its_end():
    names = snippets("tutorial-landing.md")
    assert names["robust"].worst == pytest.approx(0.098, abs=0.01)
    assert names["robust"].nominal_worst == pytest.approx(0.13, abs=0.01)
    assert "landing_ticks[LANDING_COUNT] = {0u, 262" in names["header"]


@pytest.mark.slow
def test_the_tutorial_of_gaits_runs_to_its_end():
    names = snippets("tutorial-gait.md")
    assert names["run"].measures.mean_speed.value == pytest.approx(0.48, abs=0.05)
    assert names["run"].ledger.closure < 1e-8
    assert names["fastest"].nominal[0] > 0.33 and names["cheapest"].nominal[1] < names["fastest"].nominal[1]
    assert names["speed"].value > 0.55
    assert names["sure"].robust.worst[0] >= 0.98 * names["sure"].optimum.worst[0] > 0.25
    assert "#define GAIT_COUNT 8u" in names["header"]


def test_the_tutorial_of_gaits_begins_as_it_says():
    names = snippets("tutorial-gait.md", 1)
    assert names["run"].measures.mean_speed.value == pytest.approx(0.48, abs=0.05)


def test_the_design_on_the_page_of_gaits_runs():
    page = (DOCS / "gaits.md").read_text(encoding="utf-8")
    (text,) = re.findall(r"```python\n(.*?)```", page, re.DOTALL)
    names: dict = {}
    exec(text, names)
    friction = names["walk"].scene.ground.friction.coefficient
    assert friction == names["best"].worst_ground["ground.friction.coefficient"] and names["walk"].ok


def test_the_objectives_and_symmetries_on_the_page_of_gaits_are_all_that_there_are():
    from tarsus.design.adaptive import Sense
    from tarsus.design.unknowns import Symmetry
    from tarsus.design.walk_objectives import OBJECTIVES

    page = (DOCS / "gaits.md").read_text(encoding="utf-8")
    for name in (*OBJECTIVES, *(one.value for one in (*Symmetry, *Sense))):
        assert f"`{name}`" in page


@pytest.mark.parametrize(
    "kind", ["sine", "square", "ramped_square", "ramp", "swept_sine", "on_off", "poling", "sampled"]
)
def test_every_signal_on_the_file_format_page_exists(kind):
    from tarsus.base.messages import alternatives, kind_of
    from tarsus.model.drive.waveforms import Waveform

    page = (DOCS / "file-format.md").read_text(encoding="utf-8")
    (row,) = [line for line in page.splitlines() if line.startswith(f"| `{kind}`")]
    found = next(member for member in alternatives(Waveform) if kind_of(member) == kind)
    for name in re.findall(r"`(\w+)`", row)[1:]:
        assert name in found.model_fields


def test_the_walker_on_the_walking_page_is_one():
    import tarsus as ts
    from tarsus.design import standing
    from tarsus.files.toml import parse_scene

    page = (DOCS / "walking.md").read_text(encoding="utf-8")
    (text,) = re.findall(r"```toml\n(.*?)```", page, re.DOTALL)
    scene = parse_scene(text)
    assert scene.robot.structure.size == 4 + 2 * 4
    rises = {
        name: wave.volts(np.array([0.0, 0.005, 0.01, 0.015])).argmax()
        for name, wave in scene.waveforms.items()
    }
    assert rises == {"LF": 0, "hind": 1, "RF": 2}
    assert min(standing(scene).initial.displacement) < 0.0
    stopped = ts.with_values(scene, {"signals.LF": ts.Constant(level=0.0)})
    assert stopped.waveforms["LF"].volts(np.zeros(1))[0] == 0.0


@pytest.mark.parametrize("page", ["file-format.md", "walking.md"])
def test_every_gait_is_on_the_pages(page):
    from tarsus.base.messages import alternatives, kind_of
    from tarsus.model.drive.gait import AnyGait

    text = (DOCS / page).read_text(encoding="utf-8")
    for gait in alternatives(AnyGait):
        assert f"\n| `{kind_of(gait)}` |" in text


def test_the_two_readings_of_the_film_coefficient_differ_a_thousandfold():
    from tarsus.base.units import parse_quantity

    page = (DOCS / "errata.md").read_text(encoding="utf-8")
    (other,) = re.findall(r'--set ground\.film\.coefficient="([^"]+)"', page)
    assert parse_quantity(other, "N m^2 s") == pytest.approx(1.747e-24)


def test_the_first_run_on_the_page_of_installation_runs():
    page = (DOCS / "install.md").read_text(encoding="utf-8")
    (text,) = re.findall(r"```python\n(.*?)```", page, re.DOTALL)
    names: dict = {}
    exec(text, names)
    assert names["contact"] == pytest.approx(8.23e-3, rel=1e-2) and names["bounces"] == 3


def test_verbs_on_the_page_of_installation_are_verbs():
    from tarsus.cli.app import VERBS

    page = (DOCS / "install.md").read_text(encoding="utf-8")
    said = {verb for verb in re.findall(r"^tarsus (\w+)", page, re.MULTILINE)}
    assert {"new", "read", "check", "compare", "open"} <= said <= set(VERBS)
