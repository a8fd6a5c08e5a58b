"""A sweep's description: its axes, its runs, its file, and what it refuses."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest
from scipy.stats import qmc

import tarsus as ts
import tarsus.study.layout as layout_of
from study.sweep_case import RATE, RESTITUTION, small
from tarsus.files.installed import study_names
from tarsus.fit.unknowns import Unknown, Unknowns
from tarsus.study.axes import Grid, Linspace, Logspace, Sobol, Values
from tarsus.study.layout import runs_per_unit
from tarsus.study.studyfile import frozen_texts, load_sweep, read_sweep


def test_a_grid_is_every_combination_with_the_last_axis_fastest():
    sweep = small()
    points = sweep.points()
    assert sweep.runs == 6 and sweep.design == Grid()
    assert Linspace(start=1.0, stop=3.0, count=5).values_on_grid().tolist() == [1.0, 1.5, 2.0, 2.5, 3.0]
    assert Logspace(start=1e-6, stop=1e-2, count=3).values_on_grid() == pytest.approx([1e-6, 1e-4, 1e-2])
    assert points[RESTITUTION].tolist() == [0.2, 0.2, 0.2, 0.5, 0.5, 0.5]
    assert points[RATE].tolist() == [1e-6, 5e-6, 25e-6] * 2
    for axis, values in sweep.points(slice(2, 5)).items():
        assert np.array_equal(values, points[axis][2:5])


def test_a_sobol_design_fills_every_axis_evenly():
    axes = {"a": Linspace(start=0.0, stop=1.0), "b": Logspace(start=1e-4, stop=1.0), "c": Values(values=(1.0, 2.0))}
    points = Sobol(count=64, seed=3).points(axes, slice(0, 64))
    for share in (points["a"], 1.0 + np.log10(points["b"]) / 4.0):
        assert np.histogram(share, bins=64, range=(0.0, 1.0))[0].tolist() == [1] * 64
    assert np.bincount(points["c"].astype(int)).tolist() == [0, 32, 32]
    again, longer, other = (
        Sobol(count=n, seed=s).points(axes, slice(0, n))["a"] for n, s in ((64, 3), (100, 3), (64, 4))
    )
    assert np.array_equal(points["a"], again) and np.array_equal(points["a"], longer[:64])
    assert not np.array_equal(points["a"], other)


def test_any_part_of_a_sobol_design_is_that_of_the_library():
    axes = {name: Linspace(start=0.0, stop=1.0) for name in "abc"}
    engine = qmc.Sobol(3, seed=5)
    whole = np.concatenate([engine.random(1), engine.random(1233)])
    design = Sobol(count=1234, seed=5)
    for part in (slice(0, 1234), slice(0, 1), slice(1, 2), slice(511, 514), slice(1024, 1234)):
        found = np.column_stack(list(design.points(axes, part).values()))
        assert np.array_equal(found, whole[part])


def test_units_by_time_hold_as_many_runs_as_take_it(monkeypatch):
    now = [0.0]
    monkeypatch.setattr(layout_of.time, "perf_counter", lambda: now[0])

    def worked(sweep, points):
        now[0] += 0.003 * len(points[RATE])  # a run takes 3 ms

    monkeypatch.setattr(layout_of, "work_unit", worked)
    many = {RATE: Linspace(start=1e-6, stop=2e-6, count=100_000)}
    assert runs_per_unit(small(chunk="2 s", vary=many)) == 600  # 666 to one digit
    assert runs_per_unit(small(chunk="2 ms", vary=many)) == 1
    assert runs_per_unit(small(chunk="60 s", vary={RATE: [1e-6, 2e-6]})) == 2


def test_a_store_of_too_many_units_is_refused():
    grid = {RATE: Linspace(start=1e-6, stop=2e-6, count=3_000_000)}
    with pytest.raises(ts.InputError, match="give at least 3"):
        runs_per_unit(small(chunk=2, vary=grid))


def test_an_unknown_of_a_fit_is_an_axis():
    rate = Unknown(RATE, "1 uN/s", "1 mN/s", "log")
    both = small(vary={RATE: rate, "e": Unknown(RESTITUTION, 0.1, 0.5)}, design=Sobol(count=8, seed=2))
    own = {RATE: Logspace(start=1e-6, stop=1e-3), "e": Linspace(start=0.1, stop=0.5)}
    points, cube = (
        both.points(),
        Sobol(count=8, seed=2).points(dict.fromkeys("ab", Linspace(start=0, stop=1)), slice(0, 8)),
    )
    assert both.paths("e") == (RESTITUTION,) and both.paths(RATE) == (RATE,)
    for name, axis, share in zip(own, own.values(), cube.values(), strict=True):
        assert np.array_equal(points[name], axis.at(share))
    unknowns = Unknowns.of(both.scene, [rate, Unknown(RESTITUTION, 0.1, 0.5)])
    assert np.array_equal(unknowns.values(np.column_stack(list(cube.values()))), np.column_stack(list(points.values())))


def test_values_that_vary_together_take_one_value():
    together = {"film": {"kind": "list", "values": [1e-21, 2e-21], "paths": ["ground.film.coefficient"]}}
    assert small(vary=together).paths("film") == ("ground.film.coefficient",)
    with pytest.raises(ts.InputError) as caught:
        small(vary={"both": {"kind": "list", "values": [0.1], "paths": [RESTITUTION, RATE]}})
    assert caught.value.problems == ["Sweep.vary.both: paths that vary together must be of one unit"]


@pytest.mark.parametrize(
    "sweep",
    [
        small(),
        small(design=Sobol(count=8, seed=2), vary={RATE: Logspace(start=1e-6, stop=1e-5)}),
        small(vary={"e": Linspace(start=0.1, stop=0.3, count=3, paths=(RESTITUTION,))}, duration=None),
    ],
    ids=["grid", "sobol", "together"],
)
def test_the_frozen_files_are_read_back_as_they_were(sweep, tmp_path):
    for name, text in frozen_texts(sweep).items():
        (tmp_path / name).write_text(text, encoding="utf-8")
    assert read_sweep(tmp_path / "study.toml") == sweep


def test_packaged_studies_are_good():
    assert "cantilever-adhesion" in study_names()
    for name in study_names():
        assert load_sweep(name).runs > 1
    with pytest.raises(ts.InputError, match="did you mean 'cantilever-adhesion'"):
        load_sweep("cantilever-adhesio")


HEAD = """
scene = "cantilever"
duration = "20 ms"
measures = ["peak"]
[vary]
"""
GOOD = f"{HEAD}{RESTITUTION} = [0.2, 0.5]\n"

FAULTS = [
    (f"{HEAD}robot.feet.tip.normal = [1.0]", "vary.robot.feet.tip.normal: "),
    (GOOD.replace('"cantilever"', '"cantilver"'), "scene: no device is called 'cantilver'; did you mean"),
    (GOOD.replace('scene = "cantilever"', ""), "scene: expected the name of a device"),
    (f'chunk = "2 m"\n{GOOD}', "chunk: expected a number of runs, or a time"),
    (f"{HEAD}ground.restitution.coeficient = [0.2]", "vary.ground.restitution.coeficient: unknown path; did you mean"),
    (f"{HEAD}{RESTITUTION} = []", f"vary.{RESTITUTION}: expected at least one value, got an empty list"),
    (f"{HEAD}{RESTITUTION} = 0.2", f"vary.{RESTITUTION}: expected a list of values, or a table"),
    (f'{HEAD}{RATE} = ["3 um"]', f"vary.{RATE}.0: expected a rate of force (N/s), got '3 um', which is a length"),
    (f'{HEAD}{RATE} = {{ kind = "logspace", start = 0.0, stop = 1.0, count = 3 }}', f"vary.{RATE}.start: "),
    (f'{HEAD}{RATE} = {{ kind = "linspace", start = 0.0, stop = 1.0 }}', f"vary.{RATE}.count: "),
    (
        f'{HEAD}{RATE} = {{ kind = "linspace", start = 0.0, stop = 1.0, count = 1 }}',
        "2 or more values between different",
    ),
    (f'{HEAD}{RATE} = {{ kind = "linspace", start = 0.0, stop = 1.0, count = 20_000_000 }}', "at most 1e+07"),
    (f"{HEAD}ground.gravity = [9.81]", "'ground.gravity' is not set"),
    (f"{HEAD}duration = [0.1, 0.2]", "vary.duration: every run of a sweep has one duration"),
    (f'{HEAD}peak = {{ kind = "list", values = [0.1], paths = ["{RATE}"] }}', "vary.peak: is a name of the results"),
    (HEAD, "vary: "),
    (GOOD.replace('"peak"', '"peek"'), "measures.0: there is no measure 'peek'; did you mean 'peak'?"),
    (GOOD.replace('"peak"', '"all_rebounds"'), "measures.0: there is no measure 'all_rebounds'; did you mean 'total_r"),
    (GOOD.replace('"peak"', '"peak", "peak"'), "measures.1: 'peak' is named twice"),
    (GOOD.replace('"peak"', ""), "measures: "),
    (GOOD.replace("20 ms", "1e7 s"), "duration: a run would take about"),
    (f"{GOOD}[set]\nground.film.thickness = 0", "set.ground.film.thickness: "),
    (f"chunk = 0\n{GOOD}", "chunk: expected a number of runs of at least 1"),
    (f'chunk = "7200 s"\n{GOOD}', "and at most 3600 s, got 7200 s"),
    (
        f'{GOOD}{RATE} = {{ kind = "linspace", start = 0, stop = 1, count = 3 }}\n[design]\nkind = "sobol"\ncount = 4',
        f"vary.{RATE}.count: a Sobol design has its own count",
    ),
]


@pytest.mark.parametrize(("text", "said"), FAULTS, ids=[said for _, said in FAULTS])
def test_a_bad_study_is_refused_with_a_sentence(text, said, tmp_path):
    file = tmp_path / "study.toml"
    file.write_text(text, encoding="utf-8")
    with pytest.raises(ts.InputError) as refused:
        read_sweep(file)
    (problem,) = refused.value.problems
    assert said in problem


def test_all_faults_are_named_at_once(tmp_path):
    file = tmp_path / "study.toml"
    file.write_text(
        f'scene = "cantilever"\nmeasures = ["peek"]\nchunk = 0\n[vary]\n{RESTITUTION} = [2]\n{RATE} = ["1 V"]\n',
        encoding="utf-8",
    )
    with pytest.raises(ts.InputError) as refused:
        read_sweep(file)
    assert [problem.split(":")[0] for problem in refused.value.problems] == [
        f"vary.{RESTITUTION}",
        f"vary.{RATE}.0",
        "measures.0",
        "chunk",
    ]


def test_the_study_on_the_sweeps_page_is_one(tmp_path):
    page = (Path(__file__).parents[2] / "docs" / "sweeps.md").read_text(encoding="utf-8")
    whole, design = re.findall(r"```toml\n(.*?)```", page, re.DOTALL)
    file = tmp_path / "study.toml"
    file.write_text(whole, encoding="utf-8")
    assert read_sweep(file).runs == 3 * 9 * 5
    file.write_text(re.sub(r", count = \d+", "", whole) + design, encoding="utf-8")
    assert read_sweep(file).runs == 1024
