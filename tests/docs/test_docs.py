"""The Python of the documentation runs as printed, its command lines are ones, its lists are of what there is."""

from __future__ import annotations

import math
import re
import shlex
import sys
from collections.abc import Callable
from pathlib import Path
from types import ModuleType
from typing import Any, NamedTuple

import numpy as np
import pytest
import tomlkit
import xarray

import doc_pages
import sliding_scenes
import tarsus as ts
from doc_pages import ROOT
from tarsus.base.messages import alternatives, kind_of
from tarsus.base.spec import get_value
from tarsus.base.units import parse_quantity
from tarsus.files.toml import parse_scene

PAGES = doc_pages.PAGES | {"README.md": (ROOT / "README.md").read_text(encoding="utf-8")}
ELSEWHERE = {
    "CONTRIBUTING.md": "lint/test_repository.py",  # the law of the examples, which they run
    "calibrate.md": "calibrate/test_calibrating.py",
}
"""Pages whose Python other tests run."""
Names = dict[str, Any]


def blocks(page: str, language: str = "python") -> list[str]:
    return re.findall(rf"^```{language}\n(.*?)^```", PAGES[page], re.DOTALL | re.MULTILINE)


# ---- what pages need that they do not make


def nothing(folder: Path) -> Names:
    return {}


def clone(folder: Path) -> Names:
    """The folders of a clone that a page uses."""
    for name in ("examples", "benchmarks", "tests"):
        (folder / name).symlink_to(ROOT / name)
    return {}


def lab(folder: Path) -> Names:
    """A small campaign where the page of identification has a whole one."""
    from identify.campaigns import of_known_structure

    of_known_structure(folder / "lab")
    return {}


def records(folder: Path) -> Names:
    """Files as the page of readers names them: a table of a leg, and frequency responses in MATLAB's format."""
    from scipy.io import savemat

    def table(file: str, head: str, *columns: np.ndarray) -> None:
        rows = "\n".join(",".join(f"{x:.9g}" for x in row) for row in np.column_stack(columns))
        (folder / file).write_text(f"{head}\n{rows}")

    time = np.arange(200) * 1e-4
    table("leg.csv", "t [s],Ch1,Ch2", time, np.sin(300.0 * time), 8.0 * np.sign(np.cos(300.0 * time)))
    line = np.arange(1, 65) * 0.3125
    response = 1.0 / (10.0**2 - line**2 + 0.5j * line)
    savemat(folder / "leg.mat", {"H": response})
    savemat(folder / "h.mat", {"frequency": line, "Hre": response.real, "Him": response.imag})
    table("h.csv", "frequency [Hz],mag,arg", line, np.abs(response), np.degrees(np.angle(response)))
    return {}


def plate(folder: Path) -> Names:
    """Responses of two modes at three points, as a universal file."""
    from readers.test_uff import function, write

    hertz = np.arange(100.0, 1500.0, 1.0)
    poles = [(400.0, 0.01), (900.0, 0.008)]
    shapes = np.array([[1.0, 0.7, -0.4], [0.5, -0.8, 1.0]])
    sets = []
    for point in range(3):
        value = sum(
            shapes[k, point] * shapes[k, 0] / (f**2 - hertz**2 + 2j * d * f * hertz) for k, (f, d) in enumerate(poles)
        ) * -((2.0 * np.pi * hertz) ** 2)
        sets.append(function(value, hertz, 4, point + 1, ref_dir=3, ordinate_spec_data_type=12))
    write(folder / "plate.uff", sets)
    return {}


def gradients(folder: Path) -> Names:
    paths = ["ground.film.coefficient", "robot.feet.tip.gap"]
    vary = {"robot.feet.tip.gap": [69e-6, 70e-6]}
    return {
        "ts": ts,
        "scene": ts.load_scene("cantilever"),
        "times": [1e-3, 2e-3],
        "paths": paths,
        "vary": vary,
        "sliding": sliding_scenes.cantilever(adhesion=None),
    }


def determined(folder: Path) -> Names:
    draws = np.random.default_rng(1).normal([2.0, 5.0], [0.1, 0.2], (400, 2))
    return {"names": ["a", "b"], "values": [2.0, 5.0], "draws": draws, "units": {"a": "m", "b": "s"}}


def cluster(folder: Path) -> Names:
    """A study, and a cluster of one thread here in place of the one that dask-jobqueue would start."""
    import distributed

    doc_pages.sweep_study(folder)

    class SLURMCluster(distributed.LocalCluster):
        def __init__(self, cores: int, memory: str, walltime: str) -> None:
            super().__init__(n_workers=1, threads_per_worker=1, processes=False, dashboard_address=None)

        def adapt(self, maximum_jobs: int) -> None:
            """It has what it has."""

    sys.modules["dask_jobqueue"] = ModuleType("dask_jobqueue")
    sys.modules["dask_jobqueue"].__dict__["SLURMCluster"] = SLURMCluster
    return {}


def drops(folder: Path) -> Names:
    """The page's own folder, of its blocks."""
    device, claims = blocks("validation.md", "toml")
    study, (measured,) = blocks("validation.md")[-1], blocks("validation.md", "text")
    (folder / "drops").mkdir()
    for name, text in {
        "device.toml": device,
        "claims.toml": claims,
        "study.py": study,
        "measured.csv": measured,
        "notes.md": "Drops.",
    }.items():
        (folder / "drops" / name).write_text(text, encoding="utf-8")
    return {}


def law(folder: Path) -> Names:
    (folder / "examples").symlink_to(ROOT / "examples")
    return {}


# ---- what must hold afterwards


def exported(names: Names) -> None:
    assert [Path(file).name for file in names["files"]] == [
        "model.mat",
        "series.mat",
        "laws.m",
        "events.csv",
        "run_model.m",
        "lost.txt",
    ]
    assert names["lost"] == []


def simulated_unit(names: Names) -> None:
    sim = ts.Session("millipede")
    sim.reset()
    ways = [sim.step({"R1": 14.0, "L1": 14.0}, dt).body["surge"] for dt in np.diff(names["seen"]["time"]).tolist()]
    assert names["seen"]["body.surge"][1:].tolist() == ways


def a_law(names: Names) -> None:
    assert names["run"].ok


def on_stairs(names: Names) -> None:
    assert len(names["walk"].events) > 20 and names["walk"].ledger.closure < 1e-8
    assert names["drawn"].share("mean_speed", -1.0)[0] == 1.0  # all robots walk on to the end


def shaken(names: Names) -> None:
    """Where it meets the ground, and, of a beam far above it, the swing that a base makes at resonance."""
    assert names["run"].ok and names["run"].events["time"][0] == pytest.approx(38.5e-3, rel=5e-3)
    high = ts.with_values(names["shaken"], {"robot.feet.tip.gap": 1e-3})
    structure = high.robot.structure
    mass, stiffness = structure.matrices().mass, structure.matrices().stiffness
    squares, shapes = np.linalg.eig(np.linalg.solve(mass, stiffness))
    first = shapes[:, np.argmin(squares)]
    share = (structure.row("tip") @ first) * (first @ mass @ structure.vertical()) / (first @ mass @ first)
    swing = 2e-6 * share / (2.0 * structure.damping_ratios[0])
    gap = ts.simulate(high, "0.2 s").at(np.linspace(0.19, 0.2, 3000)).state.gap
    assert 0.5 * np.ptp(gap) == pytest.approx(abs(swing), rel=1e-2)


def walks(names: Names) -> None:
    a_law(names)
    assert names["uphill"].ok and names["uphill"].measures.stride.value == pytest.approx(-2.8e-6, rel=0.1)


def climbs(names: Names) -> None:
    up, down = names["climbs"], names["falls"]
    assert up.ok and down.ok and max(up.ledger.closure, down.ledger.closure) < 1e-8
    rises = np.diff(up.at(np.array([1.0, 2.0, 3.0, 4.0])).body[0])
    assert rises == pytest.approx(np.full(3, 2.45e-3), rel=0.05)
    held, fell = down.at(np.array([0.5, 0.8])).body[0]
    assert held > -3e-3 and fell < -0.2
    assert names["modes"]["mode2"].frequency == pytest.approx(math.sqrt(8e6 / 3.0) / (2.0 * math.pi), rel=1e-9)
    assert names["trot"].ok and names["trot"].ledger.closure < 1e-8


def turns(names: Names) -> None:
    """The table of turning: rates by simulation, and both rules of thumb."""
    run, robot = names["turns"], names["hexapod"]
    straight = ts.simulate(ts.with_values(robot, {"gait.turn": 0.0}))
    assert straight.measures.mean_speed.value == pytest.approx(0.139, abs=5e-4)
    assert run.ok and run.ledger.closure < 1e-8
    assert run.measures["turn_rate"].value == pytest.approx(0.67, abs=0.01)
    assert names["rates"] == pytest.approx([-0.67, 0.0, 0.67, 2.28, 4.10], abs=0.02)
    legs = robot.robot.structure.legs.values()
    y, x = sum(leg.y**2 for leg in legs), sum(leg.x**2 for leg in legs)
    whole = 0.139 / 0.01982
    assert [whole * share for share in (0.5, 1.0, 2.0)] == pytest.approx([3.5, 7.0, 14.0], abs=0.05)
    assert y / (y + x) == pytest.approx(0.39, abs=0.01)
    yaw = run.scene.robot.structure.body_coordinates.index("yaw")
    ahead, aside = (float(names["where"][name][-1]) for name in ("path_x", "path_y"))
    assert run.measures["heading"].value == pytest.approx(run.marks["body"][-1, yaw])
    assert math.hypot(ahead, aside) == pytest.approx(0.119, rel=0.02)
    assert names["aside"].at([0.3]).body[yaw - 1, 0] > 1e-3


def restitution(names: Names) -> None:
    assert np.isfinite(names["found"].restitution.value)


def tooth(names: Names) -> None:
    wave = names["Tooth"](top="8 V", half="10 ms")
    assert wave.volts(np.array([0.005, 0.01, 0.025])) == pytest.approx([4.0, 8.0, 4.0])


def files(names: Names) -> None:
    assert names["record"].count == 200 and names["record"].drive == "Ch2"
    assert len(names["response"].frequency) == 64


def a_fit(names: Names) -> None:
    first = names["result"]
    gap, push = first.ranges
    assert gap.value == pytest.approx(70e-6, abs=0.2e-6) and push.value == pytest.approx(-622.1e-9, rel=2e-3)
    assert {gap.verdict, push.verdict} == {"determined"} and first.cost < 1e-9
    found, problem = names["found"], names["problem"]
    assert found.values["robot.feet.tip.gap"] == pytest.approx(70e-6, rel=1e-6)
    true = problem.scene.ground.restitution.coefficient
    assert found.values["ground.restitution.coefficient"] == pytest.approx(true, rel=1e-4)
    assert found.values["ground.film.coefficient"] == pytest.approx(1.747e-21, rel=1e-3)
    assert found.evaluations < 10


def a_gait(names: Names) -> None:
    friction = names["walk"].scene.ground.friction.coefficient
    assert friction == names["best"].worst_ground["ground.friction.coefficient"] and names["walk"].ok


def any_design(names: Names) -> None:
    one = names["drive"].robust
    assert one.beyond == 0.0 and one.risk[0] > 60e-6 and one.motion.means["peak"] < 300e-6


def identified(names: Names) -> None:
    low, high = names["found"].steps["adhesion"].interval("ground.adhesion.rate")
    assert 0.0 < low < high


def first_run(names: Names) -> None:
    assert names["contact"] == pytest.approx(7.94e-3, rel=1e-2) and names["bounces"] == 4


def a_landing(names: Names) -> None:
    assert names["softer"] < 0.5 and names["plain"] == pytest.approx(0.633, abs=1e-3)
    assert "LANDING_COUNT" in names["header"]


def hardest(amplitude: float, duty: float = 0.5) -> float:
    """Hardest impact [m/s] of the scene on the pages of torch and JAX."""
    scene = ts.load_scene("cantilever", volts=8, hz=50, wave="square")
    there = ts.with_values(scene, {"signals.pzt.amplitude": amplitude, "signals.pzt.duty": duty})
    return ts.simulate(there, 0.06).measures["hardest_impact"].value


def by_torch(names: Names) -> None:
    """Derivatives against differences, of a run and through three steps."""
    torch = names["torch"]
    own = (hardest(8.0001) - hardest(7.9999)) / 2e-4
    assert names["hardest"].item() == hardest(8.0)
    assert names["values"].grad[0].item() == pytest.approx(own, rel=1e-4)
    ends = []
    for by in (1e-5, -1e-5):
        session = ts.Session("hexapod")
        session.reset()
        for volts in (5.0, -3.0 + by, 2.0):
            state = session.step({"pzt": volts}, "1 ms")
        ends.append(state.x[0])
    assert names["tip"].item() == pytest.approx(state.x[0], rel=1e-3)
    assert names["volts"].grad[1].item() == pytest.approx((ends[0] - ends[1]) / 2e-5, rel=1e-3)
    assert names["volts"].grad.dtype is torch.float64


def by_jax(names: Names) -> None:
    """Value and derivatives of the price against differences."""

    def price(amplitude: float) -> float:
        return hardest(amplitude) ** 2 + 1e-3 * (amplitude**2 + 0.25)

    assert float(names["value"]) == pytest.approx(price(8.0), rel=1e-12)
    assert float(names["slopes"][0]) == pytest.approx((price(8.0001) - price(7.9999)) / 2e-4, rel=1e-4)


def stepped(names: Names) -> None:
    state, slopes = names["state"], names["slopes"]
    assert names["way"] == pytest.approx(65.7e-6, rel=2e-3) and state.time == pytest.approx(0.102)
    assert slopes.by("drive.L1").shape == (12,) and np.isfinite(slopes.by_state).all()
    assert names["back"].state.time == pytest.approx(0.101) and names["seen"].x.shape == (64, 6)
    assert names["many"].state.time.min() == 0.0


def environments(names: Names) -> None:
    assert set(names["info"]) >= {"progress", "bounces", "_final_obs"} or names["rewards"].shape == (16,)
    assert names["reward"] != 0.0 and not names["truncated"].all() and names["seen"].shape == (16, 7)


def leg(names: Names) -> None:
    assert names["motion"].closure < 1e-6
    body, legs = (getattr(ts.load_scene("millipede-table").robot.structure, name) for name in ("body", "legs"))
    assert [body.mass, legs["L1"].mass] == pytest.approx([0.2e-6, 1.03e-9], rel=5e-3)


def modes(names: Names) -> None:
    assert [round(mode.frequency.value) for mode in names["fit"].modes] == [400, 900]


def orbits(names: Names) -> None:
    printed = PAGES["orbits.md"]
    assert names["orbit"].kind == "stable, period 1, 5 impacts, 1 of them held" and names["orbit"].kind in printed
    assert np.abs(names["orbit"].multipliers).max() < 1e-9
    assert str([(point.kind, round(1e6 * point.at, 4)) for point in names["found"].special]) in printed
    assert names["found"].coexisting == ()
    assert names["gait"].kind in printed and names["gait"].travel == pytest.approx(1.539e-6, rel=1e-3)


def gaits(names: Names) -> None:
    assert names["first"].kind in PAGES["attractors.md"] and names["first"].orbit.stable
    assert names["first"].travel == pytest.approx(1.539e-6, rel=1e-3)


def a_map(names: Names) -> None:
    assert names["found"].class_at(82e-6, 5.2) == "period 2, held" and '"period 2, held"' in PAGES["atlas.md"]


def turned(names: Names) -> None:
    assert names["high"] == pytest.approx(280e-6) and names["low"] == pytest.approx(17.5e-6)
    assert names["value"] == names["knobs"].explored.scene.robot.feet["tip"].gap
    assert len(names["wide"].events) == 0 and names["near"].events["time"][0] < 1e-3


def compared(names: Names) -> None:
    assert names["found"].figures()["total_time_s"].median_error == pytest.approx(0.168, abs=1e-3)
    own = ts.validate("drops")
    assert own.ok and [one.figures.rows for one in own.verdicts] == [2]


def readme(names: Names) -> None:
    sentence, closure, contact = names["printed"].splitlines()
    assert sentence == names["run"].code.value and float(closure) < 1e-8
    assert "contact" in contact or "zero gap" in contact


def spread(names: Names) -> None:
    del sys.modules["dask_jobqueue"]
    names["cluster"].close()
    assert xarray.open_dataset("out/sweep.nc").sizes["ground.adhesion.rate"] == 2


def many_runs(names: Names) -> None:
    assert names["contact"].shape == (5, 3) and np.isfinite(names["contact"]).all()
    assert names["data"]["peak"].dims == ("ground.film.coefficient", "signals.pzt.amplitude")
    assert names["first"].ok and names["second"].scene.robot.feet["tip"].gap == 65e-6
    assert names["second"].motion.engine.tables.native is names["first"].motion.engine.tables.native
    assert len(names["phases"]) == 3
    assert {"robot.feet.tip.gap", "signals.pzt.phase", "ground.film.coefficient"} <= set(names["session"].slots)


def swept(names: Names) -> None:
    assert names["result"].runs == 11


def derivatives_of_everything(names: Names) -> None:
    # by differences of fourth order
    for name, value in (("yaw", 1.2457523), ("travel", -0.200101), ("slid", -9.1287235e-7)):
        ((path, found),) = names[name].items()
        assert found == pytest.approx(value, rel=1e-4) and names[name].error[path] < 1e-4 * abs(value)


def theory(names: Names) -> None:
    assert names["moved"] == pytest.approx(names["landing"] / 2.0, rel=1e-7)
    assert names["found"] == pytest.approx(names["exact"], rel=1e-7)
    assert names["drops"] == pytest.approx(0.81)
    assert np.abs(names["orbit"].multipliers).max() < 1e-9 and names["orbit"].stable
    scores, weights = np.array([[0.10, 0.20, 0.40, 0.80]]), np.full(4, 0.25)
    least = min(a + 2.0 * weights @ np.maximum(scores[0] - a, 0.0) for a in scores[0])
    assert ts.design.cvar(0.5)(scores, weights)[0] == pytest.approx(0.6) and least == pytest.approx(0.6)


def first_gait(names: Names) -> None:
    assert names["run"].measures.mean_speed.value == pytest.approx(0.48, abs=0.05)
    assert names["run"].ledger.closure < 1e-8


def whole_gait(names: Names) -> None:
    first_gait(names)
    assert names["fastest"].nominal[0] > 0.33 and names["cheapest"].nominal[1] < names["fastest"].nominal[1]
    assert names["speed"].value > 0.55
    assert names["sure"].robust.worst[0] >= 0.98 * names["sure"].optimum.worst[0] > 0.25
    assert "#define GAIT_COUNT 8u" in names["header"]


def two_robots(names: Names) -> None:
    found = names["found"]
    assert [attractor.impacts for attractor in found] == [8, 14, 12]
    assert [attractor.share.count for attractor in found] == [48, 11, 1] and names["changes"] == 15
    mean = sum(one.share.share * one.measures["mean_speed"].value for one in found)
    assert mean == pytest.approx(195e-6, abs=0.5e-6)
    assert names["again"].measures.mean_speed.value == pytest.approx(335.9e-6, rel=1e-3)
    assert 0.1 < names["low"][1].share.share < 0.35 and len(names["low"]) == 2
    for factor, row in {0.98: (158, 331, 158), 1.0: (157, 336, 472), 1.02: (156, 341, 341)}.items():
        assert np.multiply(1e6, names["speeds"][factor]) == pytest.approx(row, abs=0.6)


def transferred(names: Names) -> None:
    """The speed that was stated of a gait is that of the robot, which another program walks."""
    found, robot = names["found"], names["robot"]
    walking = found.steps["walking"]
    true = {path: get_value(robot, path) for path in walking.paths if path not in walking.taken}
    assert len(true) == 13
    assert sum(low <= true[path] <= high for path in true for low, high in [walking.interval(path)]) >= 12
    assert walking.value("ground.friction.coefficient") == pytest.approx(0.437, abs=2e-3)
    assert names["gait"].values["gait.frequency"] == pytest.approx(114.5, abs=2.0)
    assert (names["low"], names["high"]) == pytest.approx((1.525e-3, 1.823e-3), rel=0.03)
    assert found.reliance.missed == pytest.approx(0.0053, abs=5e-3) and not found.reliance.doubts
    assert names["before"] == pytest.approx(0.169e-3, rel=0.01)
    assert names["after"] == pytest.approx(1.744e-3, rel=0.03)
    assert names["low"] <= names["after"] <= names["high"]


def over_a_step(names: Names) -> None:
    assert names["level"].measures.stride.value == pytest.approx(0.9825e-6, abs=2e-9)
    assert names["after"] - names["before"] == pytest.approx(2e-6, rel=1e-6)
    assert names["climbed"].ledger.closure < 1e-9 and names["stopped"].ledger.closure < 1e-9
    assert (names["low"], names["high"]) == (20.0, 21.0)
    assert names["foot_x"][0] == pytest.approx(155e-6, rel=1e-12)
    assert 1.7 < len(names["stopped"].events) / len(names["level"].events) < 2.1
    assert names["worst"] == 14
    assert (names["speed"].min(), names["speed"].max()) == pytest.approx((45.2e-6, 54.8e-6), rel=0.01)


def first_landing(names: Names) -> None:
    assert names["closing"]["time"] == pytest.approx(27.795e-6, abs=0.5e-9)
    account, design = names["account"], names["design"]
    assert -account.impacts / account.laws["electrostatic"] == pytest.approx(-1.0 / 3.0, abs=0.04)
    assert design.speed < 0.233 / 20.0
    assert design.signal.durations[:2] == pytest.approx((26.23e-6, 3.8e-6), abs=0.2e-6)


def whole_landing(names: Names) -> None:
    first_landing(names)
    assert names["robust"].worst == pytest.approx(0.098, abs=0.01)
    assert names["robust"].nominal_worst == pytest.approx(0.13, abs=0.01)
    assert "landing_ticks[LANDING_COUNT] = {0u, 262" in names["header"]


def a_yield(names: Names) -> None:
    assert 0.0 <= names["found"].share("mean_speed", 40e-6)[0] <= 1.0 and Path("out/yield.json").is_file()


def ran(names: Names) -> None:
    """That it ran is all there is to see."""


class Case(NamedTuple):
    """Python of a page: what must hold afterwards, what it needs, whether it takes more than some seconds, of how many
    of its first blocks, and of what lane it is, for a library that nothing else needs; of the page of sweeps, which
    shows how to read one before it makes one, the last first."""

    page: str
    check: Callable[[Names], None]
    prepare: Callable[[Path], Names] = nothing
    slow: bool = False
    count: int | None = None
    lane: str | None = None

    @property
    def marks(self) -> list[pytest.MarkDecorator]:
        return [getattr(pytest.mark, self.lane)] if self.lane else [pytest.mark.full] * self.slow


CASES = [
    Case("README.md", readme),
    Case("add-a-law.md", a_law, law),
    Case("atlas.md", a_map, slow=True),
    Case("attractors.md", gaits, slow=True),
    Case("batches.md", many_runs),
    Case("design.md", any_design),
    Case("determined.md", ran, determined),
    Case("experiment.md", restitution, slow=True),
    Case("explore.md", turned),
    Case("export.md", exported, count=1),
    Case("export.md", simulated_unit, lane="fmu"),
    Case("extending.md", tooth),
    Case("files-in.md", files, records),
    Case("fit.md", a_fit, slow=True),
    Case("gaits.md", a_gait),
    Case("ground.md", on_stairs),
    Case("gradients.md", derivatives_of_everything, gradients),
    Case("identify.md", identified, lab, slow=True),
    Case("index.md", a_law),
    Case("install.md", first_run),
    Case("landing.md", a_landing, slow=True),
    Case("environments.md", environments),
    Case("jax.md", by_jax, lane="jax"),
    Case("session.md", stepped),
    Case("torch.md", by_torch, lane="torch"),
    Case("legs.md", leg),
    Case("modal.md", modes, plate),
    Case("orbits.md", orbits, slow=True),
    Case("scale.md", spread, cluster, slow=True),
    Case("shaker.md", shaken),
    Case("sweeps.md", swept),
    Case("theory.md", theory),
    Case("tutorial-gait.md", first_gait, count=1),
    Case("tutorial-gait.md", whole_gait, slow=True),
    Case("tutorial-landing.md", whole_landing, slow=True),
    Case("tutorial-ground.md", over_a_step, slow=True),
    Case("tutorial-transfer.md", transferred, clone, slow=True),
    Case("tutorial-two-robots.md", two_robots, slow=True),
    Case("validation.md", compared, drops),
    Case("walking.md", walks),
    Case("bodies.md", climbs),
    Case("turning.md", turns),
    Case("yield.md", a_yield, slow=True),
]


def test_every_page_with_python_is_run():
    assert {page for page in PAGES if blocks(page)} == {*(case.page for case in CASES), *ELSEWHERE}
    for page, test in ELSEWHERE.items():
        assert page in (ROOT / "tests" / test).read_text(encoding="utf-8"), page


@pytest.mark.parametrize(
    "case",
    [pytest.param(case, marks=case.marks) for case in CASES],
    ids=[f"{case.page}{'' if case.count is None else ' begins'}" for case in CASES],
)
def test_the_python_of_a_page_runs(case, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("MPLBACKEND", "agg")
    monkeypatch.setattr(sys, "path", [*sys.path])  # pages may add to it
    names = case.prepare(tmp_path)
    for text in blocks(case.page)[: case.count][:: -1 if case.page == "sweeps.md" else 1]:
        exec(compile(text, case.page, "exec", dont_inherit=True), names)
    case.check(names | {"printed": capsys.readouterr().out})


def command_lines() -> list[tuple[str, str]]:
    """Every command line of Tarsus in a block for the shell."""
    found = []
    for page in sorted(PAGES):
        for block in blocks(page, "bash"):
            lines = block.replace("\\\n", " ").splitlines()
            found += [(page, line.removeprefix(".venv/bin/")) for line in lines]
    return [(page, line) for page, line in found if line.startswith("tarsus ")]


def test_every_command_line_is_one():
    from tarsus.cli.app import VOICES, build

    known = build([])
    lines = command_lines()
    assert len(lines) > 40
    for page, line in lines:
        words = [word for word in shlex.split(line, comments=True)[1:] if word not in VOICES]
        try:
            known.parse_args(words, print_error=False, exit_on_error=False)
        except Exception as error:
            pytest.fail(f"{page}: {line}: {error}")


def test_the_scene_on_the_file_format_page_is_one():
    (text,) = blocks("file-format.md", "toml")
    scene = parse_scene(text)
    assert scene.robot.feet["tip"].gap == 70e-6
    assert scene.origin("robot.feet.tip.gap").source.value == "printed"


def test_the_walker_on_the_walking_page_is_one(tmp_path):
    """What the page shows, in the file that `tarsus new device` writes."""
    ts.new("device", tmp_path / "walker.toml", legs=4, mass="0.1 g")
    whole = tomlkit.parse((tmp_path / "walker.toml").read_text(encoding="utf-8")).unwrap()
    (text,) = blocks("walking.md", "toml")
    shown = tomlkit.parse(text).unwrap()
    drives = {name: one for name, one in whole["robot"]["drives"].items() if name[:2] not in ("L2", "R2")}
    whole["robot"]["drives"] = drives | shown["robot"]["drives"]
    scene = parse_scene(tomlkit.dumps(whole | {"gait": shown["gait"]}))
    times = np.array([0.0, 0.0125, 0.025, 0.0375])
    rises = {name: scene.waveforms[name].volts(times).argmax() for name in ("L1_lift", "hind", "R1_lift")}
    assert rises == {"L1_lift": 0, "hind": 1, "R1_lift": 2}
    assert min(ts.design.standing(scene).initial.displacement) < 0.0
    stopped = ts.with_values(scene, {"signals.L1_lift": ts.Constant(level=0.0)})
    assert stopped.waveforms["L1_lift"].volts(np.zeros(1))[0] == 0.0


@pytest.mark.parametrize(
    "kind", ["sine", "square", "ramped_square", "ramp", "swept_sine", "on_off", "poling", "sampled"]
)
def test_every_signal_on_the_file_format_page_exists(kind):
    from tarsus.model.drive.waveforms import Waveform

    (row,) = [line for line in PAGES["file-format.md"].splitlines() if line.startswith(f"| `{kind}`")]
    found = next(member for member in alternatives(Waveform) if kind_of(member) == kind)
    assert {*re.findall(r"`(\w+)`", row)[1:]} <= set(found.model_fields)


def test_what_pages_list_is_all_that_there_is():
    from tarsus.design.adaptive_gait import Sense
    from tarsus.design.free import Symmetry
    from tarsus.design.measures import OBJECTIVES
    from tarsus.model.drive.gait import AnyGait

    assert all(f"\n| `{kind_of(gait)}` |" in PAGES["walking.md"] for gait in alternatives(AnyGait))
    for page in ("file-format.md", "contact.md"):
        rules = (ts.laws.CaptureUnlessPulled, ts.laws.RestituteFirst, ts.laws.PullAsPrinted)
        assert all(f"`{kind_of(rule)}`" in PAGES[page] for rule in rules)
    listed = (*OBJECTIVES, *(one.value for one in (*Symmetry, *Sense)))
    assert all(f"`{name}`" in PAGES["gaits.md"] for name in listed)


def test_the_two_readings_of_the_film_coefficient_differ_a_thousandfold():
    (other,) = re.findall(r'--set ground\.film\.coefficient="([^"]+)"', PAGES["errata.md"])
    assert parse_quantity(other, "N m^2 s") == pytest.approx(1.747e-24)
