"""Studies of a bouncing ball, from file to folder: recovery, choice of a column, threads, ensemble, device files."""

from __future__ import annotations

import json
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

import tarsus as ts
from calibrate.toys import BALL, ball_study, true_rows
from tarsus.base.errors import InputError
from tarsus.calibrate.calibrating import calibrate
from tarsus.calibrate.cells import absolute_of
from tarsus.calibrate.description import MeasureColumn, TableSampling
from tarsus.calibrate.faults import Faults
from tarsus.calibrate.lowering import lower_study
from tarsus.calibrate.results import calibration_table
from tarsus.calibrate.skill import naive_errors
from tarsus.calibrate.studyfile import STUDY_FILE, load_study
from tarsus.calibrate.weighted_ensemble import load_ensemble
from tarsus.fit import Verdict

DOCS = Path(__file__).parents[2] / "docs"
TRUTH = {"e": 0.8, "push": 0.6}


@pytest.fixture(scope="module")
def finished(tmp_path_factory):
    """A finished calibration of the ball, its folder, and the text of its table."""
    folder = tmp_path_factory.mktemp("ball")
    table = true_rows(folder, TRUTH)
    file = ball_study(folder, table + "200,,\n")
    return calibrate(file, folder / "out", threads=1), folder / "out", file


@pytest.mark.slow
def test_the_numbers_of_the_ball_are_recovered_and_each_row_is_predicted_without_it(tmp_path):
    rows = true_rows(tmp_path, TRUTH, (40, 50, 65, 80, 100, 120))
    long = BALL.replace('"spread": 3', '"spread": 40')
    file = ball_study(tmp_path, rows, long, generations=20, leave_out=True)
    found = calibrate(file, threads=2)
    solution = found.solution
    assert found._repr_html_().count(">determined</td>") == len(TRUTH)
    assert solution.fit.best.hypothesis.options == {"height": "average"}
    for one in solution.fit.best.ranges(solution.problem.unknowns):
        assert one.value == pytest.approx(TRUTH[one.name], rel=0.03) and one.verdict is Verdict.DETERMINED
    observed = solution.problem.objective.cells.observed
    assert solution.excluded is not None
    for row, predictions in zip(observed, solution.excluded, strict=True):
        assert predictions[1].median == pytest.approx(row[1], rel=0.05)


def test_a_row_without_values_is_predicted(finished):
    result, folder, _ = finished
    assert result.lowered.others == (3,)
    lowered = result.lowered
    truth = lowered.forward(0, np.array([[TRUTH["e"], TRUTH["push"]]]), [3])[0, 0, :, 0]
    height = truth[lowered.forward.channels.index("mean_height")]
    one = next(one for one in result.predicted[3] if one.measure == "height")
    assert one.median == pytest.approx(height, rel=0.1)
    rows = json.loads((folder / "calibration.json").read_text())["rows"]
    first = rows[0]["training"]["height"]
    assert first["error"] == pytest.approx(1.0 - first["median"] / first["observed"])  # as its page has it
    entry = rows[3]
    assert entry["fitted"] is False and entry["predicted"]["height"]["median"] == pytest.approx(100.0 * one.median)


def test_the_folder_holds_an_ensemble_that_predicts_the_same(finished):
    result, folder, _ = finished
    whole = load_ensemble(folder)
    (found,) = whole.predict([{"drop": 200}])
    for one in result.predicted[3]:
        assert found[one.measure].median == pytest.approx(one.median, rel=1e-9)
        assert found[one.measure].low == pytest.approx(one.low, rel=1e-9)
    assert [one.weights[0] for one in whole.ensembles] == pytest.approx([1.0 / 6.0] * len(whole.ensembles)), "the best"
    assert found["rate"].p_bounce is not None and found["rate"].p_bounce > 0.8
    with pytest.raises(InputError, match="no condition 'dorp'"):
        whole.predict([{"dorp": 3}])


def test_rows_of_a_file_and_of_a_frame_are_predicted_and_values_of_the_scene_prevail(finished, tmp_path):
    whole = finished[0].ensemble
    file = tmp_path / "asked.csv"
    file.write_text("drop,rate\n40,7\n80,\n", encoding="utf-8")
    told = whole.predict(file)
    frame = pd.DataFrame({"drop": [40, 80], "rate": [7.0, np.nan], "ground.restitution.coefficient": [0.1, 0.1]})
    dull = whole.predict(frame)
    plain = whole.predict([{"drop": 40}]) + whole.predict({"drop": 80})
    assert [one["rate"].median for one in told] == [one["rate"].median for one in plain]
    assert all(one["height"].median < other["height"].median for one, other in zip(dull, told, strict=True))


def test_every_hypothesis_is_a_device_with_provenance_and_intervals(finished):
    result, folder, _ = finished
    scene = ts.read_scene(folder / "branch-1.toml")
    path = "ground.restitution.coefficient"
    best, push = result.solution.fit.ensembles[0].ranges(result.lowered.problem.unknowns)
    assert ts.get_value(scene, path) == pytest.approx(best.value)
    origin = scene.origin(path)
    assert origin is not None and origin.source.value == "calibrated" and "ball" in origin.note
    low, high = scene.interval(path) or (np.nan, np.nan)
    assert low <= best.value <= high
    assert ts.get_value(scene, "initial.velocity.0") == pytest.approx(2.0 * push.value)
    gap = scene.origin("robot.feet.ball.gap")
    assert gap is not None and gap.note == "Set by a study."


def test_a_column_that_is_missed_by_far_has_a_sentence(finished):
    numbers = finished[0].to_dict()
    assert "tolerances: it does not hold" not in str(calibration_table(numbers))
    numbers["discrepancy"]["height"]["sigma"] = 231.0  # as of a table in m whose unit is said to be um
    assert "The model misses height by 230 tolerances" in " ".join(str(calibration_table(numbers)).split())


@pytest.mark.parametrize(
    ("sigma", "cells", "said"), [(1.9, 2, "determined"), (2.1, 2, "preferred"), (1.9, 1, "preferred")]
)
def test_a_model_that_misses_a_column_or_has_more_unknowns_than_cells_determines_nothing(finished, sigma, cells, said):
    solution, fit = finished[0].solution, finished[0].solution.fit
    missed = replace(fit.discrepancy, sigma=np.array([1.0, sigma]))
    fit = replace(fit, ensembles=tuple(replace(one, doubt="") for one in fit.ensembles), discrepancy=missed)
    fit = replace(fit, freedom=replace(fit.freedom, cells=cells))
    numbers = replace(finished[0], solution=replace(solution, fit=fit)).to_dict()
    assert {one["unknowns"]["e"]["determined"] for one in numbers["branches"] if one["dropped"] is None} == {said}


def test_a_search_that_is_too_short_determines_nothing(finished, tmp_path):
    narrow = [one for one in finished[0].to_dict()["branches"] if one["dropped"] is None]
    assert [one["determined"] for one in narrow[0]["unknowns"].values()] == ["preferred", "undecided"]
    assert "was too short: the chains of the ensemble have not mixed" in " ".join(str(finished[0].table()).split())
    text = BALL.replace('"spread": 3', '"spread": 20, "local_search": 0')
    result = calibrate(ball_study(tmp_path, true_rows(tmp_path, TRUTH), text, generations=0), threads=1)
    assert "came" in result.solution.fit.best.doubt and "residual scales below it" in result.solution.fit.best.doubt


def test_skill_is_against_predictors_that_take_numbers_of_conditions_as_such(finished):
    result, folder, _ = finished
    height, drops = result.lowered.problem.objective.cells.observed[:, 1], [{"drop": float(d)} for d in (50, 80, 120)]
    told = json.loads((folder / "calibration.json").read_text())["summary"]["training"]["measures"]["height"]
    assert told["naive"] == naive_errors(height, drops) != naive_errors(height, [{"drop": str(d)} for d in drops])
    assert told["skill"] == 1.0 - told["mean_relative_error"] / min(told["naive"].values())


def test_threads_do_not_change_a_byte(finished, tmp_path):
    _, folder, file = finished
    calibrate(file, tmp_path / "two", threads=2)
    for name in ("calibration.json", "mixture.json", "branch-1.toml"):
        assert (tmp_path / "two" / name).read_bytes() == (folder / name).read_bytes()


def test_a_folder_explains_itself_and_is_not_overwritten_or_mistaken(finished):
    _, folder, file = finished
    again = load_study(folder / STUDY_FILE)
    assert again.study == load_study(file).study and again.table.rows == load_study(file).table.rows
    with pytest.raises(InputError, match="holds a calibration; continue it there with --resume"):
        calibrate(file, folder)
    with pytest.raises(InputError, match="holds another calibration"):
        calibrate(file, folder, seed=7, resume=True)


def test_every_fault_of_a_study_is_told_at_once(tmp_path):
    text = BALL.replace('"measure": "peak", "relative"', '"measure": "peek", "relative"').replace(
        'paths": ["ground.restitution.coefficient"]', 'paths": ["ground.restitution.coeficient"]'
    )
    with pytest.raises(InputError) as error:
        lower_study(load_study(ball_study(tmp_path, "50,1,1\n", text)))
    said = "\n".join(error.value.problems)
    assert "no measure 'peek'; did you mean 'peak'" in said
    text = text.replace("device =", "devise =").replace('"relative": 0.02', '"relative": 0.02, "absolut": 3')
    with pytest.raises(InputError, match="there is no setting 'devise'; did you mean 'device'"):
        load_study(ball_study(tmp_path, "50,1,1\n", text))
    text = text.replace("devise =", "nothing =")
    with pytest.raises(InputError) as error:
        load_study(ball_study(tmp_path, "50,1,1\n", text))
    assert (
        "device: expected" in str(error.value) and "absolut" in str(error.value) and "\nscene: " not in str(error.value)
    )


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("robot.feet.ball.gap", "robot.feet.ball.gab", "did you mean 'robot.feet.ball.gap'"),
        ('"1 mm"', '"1 mm/s"', "measures.height.absolute: expected a length"),
        ('"unit": "cm"', '"unit": "V"', "measures.height.unit: expected a length (m), got '1 V', which is a voltage"),
        ('{"height": "mean_height"}', '{"hight": "mean_height"}', "did you mean 'height'"),
        (
            '{"height": "mean_height"}',
            '{"height": "impacts"}',
            "average.height: 'impacts' has another unit than 'peak'",
        ),
        ('"settle"', '"foot": "bal", "settle"', "sampling.foot: the robot has no foot 'bal'; did you mean 'ball'"),
        ('"1 s", "window": "2 s"', '"1 s"', "sampling.window: row 1 has no drive period; say how long a window is"),
        ('"settle": "1 s"', '"settle": "1e13 s"', "sampling: row 1: a run would take about"),
        ("choices = {", 'choices = {"way": {"options": ["a", "a"]}, ', "choices.way.options: one is there twice"),
        ('"low": 0.5', '"low": 0.5, "size": 0', "unknowns.e: size: expected a value above 0"),
        ("unknowns.push]", "unknowns.pusch]", "there is no unknown 'pusch'; did you mean 'push'"),
        ("row['drop']", "row['dorp']", "line 20: KeyError: 'dorp'"),
        ("    return {", "    return 3, {", "expected changes by path, got tuple"),
        ("2 * unknowns.push", "1 / (unknowns.push - 0.75)", "line 20: ZeroDivisionError: float division by zero"),
        ("    return {", "    raise ValueError('no such row')\n    return {", "row 1 and 1 more: "),
        ("2 * unknowns.push", "2", "unknowns.push: it changes nothing in any row"),
        ("choices = {", 'choices = {"way": {"options": ["a", "b"]}, ', "choices.way: it changes nothing in any row"),
        ("choices = {", 'choices = {"way": {"options": "a"}, ', "choices.way.options: expected a list, got 'a'"),
        ("def changes(", "def change(", "defines no function changes(unknowns, row)"),
        ('"initial', '"ground.restitution.coefficient": 0.5, "initial', "unknowns.e: the function changes"),
        ('["drop"]', '["drip"]', "the table has no column 'drip'; did you mean 'drop'"),
    ],
)
def test_a_fault_is_told_with_its_place(tmp_path, old, new, said):
    assert old in BALL
    with pytest.raises(InputError) as error:
        ts.check(ball_study(tmp_path, "50,1,1\n60,1,1\n", BALL.replace(old, new)))
    assert said in str(error.value) and str(error.value).count("measures.height.unit") < 2


def test_structure_and_whole_numbers_may_depend_on_unknowns(tmp_path):
    """Sets of other templates than that of the middle are read as those that share one."""
    kind = '"capture_unless_pulled" if unknowns.e < 0.7 else "pull_as_printed"'
    text = BALL.replace("    return {", f'    return {{"ground.landing": {{"kind": {kind}}}, ')
    lowered = lower_study(load_study(ball_study(tmp_path, "50,1,1\n", text)))
    sets = np.array([[0.6, 1.0], [0.9, 1.0], [0.65, 0.5]])
    every = lowered.forward(0, sets, (0,))
    each = [lowered.forward(0, one[None], (0,))[0] for one in sets]
    assert np.isfinite(every[:, 0, 0]).all() and np.array_equal(every, np.array(each), equal_nan=True)
    variant = lowered.forward.variants[0]
    scenes = [variant.scene_of({"e": e, "push": 1.0}, variant.rows[0]) for e in (0.6, 0.9)]
    assert [one.ground.landing.kind for one in scenes] == ["capture_unless_pulled", "pull_as_printed"]


def test_a_study_in_the_former_form_is_told_what_to_do(tmp_path):
    (tmp_path / "old.toml").write_text('device = "cantilever"\ntable = "table.csv"\n', encoding="utf-8")
    with pytest.raises(InputError, match=r"is a Python file that defines changes\(unknowns, row\)"):
        load_study(tmp_path / "old.toml")


def test_a_bad_table_is_told_with_its_lines(tmp_path):
    with pytest.raises(InputError) as error:
        load_study(ball_study(tmp_path, "50,1,1,4\n60,1\n70,1,2,3,4\n"))
    assert len(error.value.problems) == 2 and "line 2: 4 cells" in str(error.value)
    with pytest.raises(InputError, match="line 3 of the table: 'rate' should be a number, got 'many'"):
        lower_study(load_study(ball_study(tmp_path, "50,1,1\n60,many,1\n")))
    with pytest.raises(InputError, match="row 2: 'drop': expected a value"):
        lower_study(load_study(ball_study(tmp_path, "50,1,1\n,1,1\n")))


@pytest.mark.parametrize(("measure", "count"), [("bounces", 0.2), ("bounces_per_second", 10.0)])
def test_a_count_is_known_within_one_in_the_window(measure, count):
    """Of 0.1 s: one bounce in five drive periods of 20 ms."""
    sampling = TableSampling(settle=0.0, window=0.1)
    found = absolute_of(sampling, MeasureColumn(measure=measure, absolute=count, counts=True), 0.02, "", Faults())
    assert found == pytest.approx(np.sqrt(2.0) * count)


def test_a_constraint_has_a_run_of_its_own(tmp_path):
    text = (
        BALL
        + """
constraints = [
    {"name": "a ball from 1 m rises to 60 cm at most after a second", "conditions": [{"drop": 100}, {"drop": 50}],
     "measure": "peak", "max": "60 cm", "softness": "1 cm"},
    {"name": "it swings by the whole height", "conditions": [{"drop": 100}], "measure": "swing", "min": "1 cm",
     "softness": "1 mm", "set": {"ground.restitution.coefficient": 0.0, "initial.velocity": [0.0]}},
]
"""
    )
    lowered = lower_study(load_study(ball_study(tmp_path, "50,1,1\n60,1,1\n", text)))
    assert lowered.problem.rows == (0, 1, 2, 3, 4)
    assert [one.rows for one in lowered.problem.objective.limits] == [(0, 1), (2,)]
    sets = np.array([[0.6, 1.0], [0.9, 1.0]])
    readings = lowered.forward(0, sets, lowered.problem.rows)
    costs = lowered.problem.objective.pieces(readings, lowered.problem.hypotheses[0])
    assert costs.limits[0][0] == 0.0 and costs.limits[0][1] > 0.0
    assert costs.limits[1][0] > 0.0, "with no restitution the ball lies still after a second"


def test_a_value_that_a_scene_refuses_spoils_no_other_row(tmp_path):
    lowered = lower_study(load_study(ball_study(tmp_path, "50,1,1\n70,1,1\n")))
    variant = lowered.forward.variants[0]
    bad = replace(variant.rows[1], cells={"drop": -1.0})
    forward = replace(lowered.forward, variants=(replace(variant, rows=(variant.rows[0], bad)),))
    readings = forward(0, np.array([[0.8, 0.5]]), (0, 1))
    assert np.isfinite(readings[0, 0]).any() and np.isinf(readings[0, 1]).all()


def test_draws_start_with_velocities_of_their_own_and_all_sets_with_the_same(tmp_path):
    text = BALL.replace('"windows": 1', '"windows": 2, "draws": 3, "speed": "20 cm/s"').replace(
        '"window": "2 s"', '"window": "0.8 s"'
    )
    lowered = lower_study(load_study(ball_study(tmp_path, "50,1,1\n70,1,1\n", text)))
    sets = np.array([[0.8, 0.5], [0.8, 0.5], [0.7, 0.5]])
    readings = lowered.forward(0, sets, (0, 1))
    assert readings.shape == (3, 2, len(lowered.forward.channels), 6)
    assert np.array_equal(readings[0], readings[1], equal_nan=True)
    peaks = readings[0, 0, lowered.forward.channels.index("peak")]
    assert len(set(peaks.tolist())) == 6, "every draw and window has its own"
    one = lowered.forward(0, sets[2:], (1,))
    assert np.array_equal(one[0, 0], readings[2, 1], equal_nan=True), "neighbours and other rows change nothing"


def test_the_study_on_the_calibration_page_is_one(tmp_path):
    page = (DOCS / "calibrate.md").read_text(encoding="utf-8")
    text = re.findall(r"```python\n(.*?)```", page, re.DOTALL)[0]
    (tmp_path / "study.py").write_text(text, encoding="utf-8")
    lines = (
        "freq_hz,volt_v,wave,bounces,peak_um",
        "50,8,sine,1,152",
        "50,8,square,1,",
        "100,8,sine,1~2,156",
        "5,6,sine,,",
    )
    (tmp_path / "table.csv").write_text("\n".join(lines) + "\n", encoding="utf-8")
    lowered = lower_study(load_study(tmp_path / "study.py"))
    problem = lowered.problem
    assert lowered.trained == (0, 1, 2) and lowered.others == (3,)
    assert {one.name for one in problem.hypotheses} == {
        f"polarity {a}, peak {b}" for a in ("plain", "half") for b in ("highest", "average")
    }
    assert problem.objective.cells.observed[2].tolist() == [1.5, pytest.approx(156e-6)]
    values = problem.unknowns.values(np.array([0.5, 0.5, 0.5]))
    half = lowered.forward.variants[1]
    scene, found = half.run(dict(zip(problem.unknowns.names, values.tolist(), strict=True)), half.rows[0])
    assert found["signals.pzt.amplitude"] == 4.0 and found["signals.pzt.frequency"] == 50.0
    assert found["robot.drives.pzt.load.participation.0"] == pytest.approx(np.sqrt(11 * 22) / 164.0)
    assert found["robot.drives.pzt.law.cubic"] == pytest.approx(2.7e-9)
    assert found["robot.drives.pzt.law.linear"] == pytest.approx(-700e-9)
    assert found["signals.pzt.offset"] == 2.0 and scene.signals["pzt"].kind == "sine"
    readings = lowered.forward(0, values[None], problem.rows)
    assert readings.shape == (1, 4, len(lowered.forward.channels), 2) and np.isfinite(readings[0, :, 1]).all()
