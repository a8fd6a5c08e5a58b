"""The packaged calibrations: their studies, and the devices and the mixture that came out of them."""

from __future__ import annotations

import hashlib
import json
from dataclasses import replace
from importlib.resources import files
from pathlib import Path

import numpy as np
import pytest
from scipy.optimize import lsq_linear

import tarsus as ts
from example_files import load_file
from tarsus.calibrate.lowering import lower_study
from tarsus.calibrate.studyfile import frozen_texts, load_study
from tarsus.fit.ranges import weighted_quantile
from tarsus.measure import window_statistics
from tarsus_reproduce.cantilever import reproduce_cantilever
from tarsus_reproduce.cantilever_studies import loop_table
from tarsus_reproduce.ensembles import packaged_ensemble
from tarsus_reproduce.robots import printed_rows, row_scene

PACKAGE = load_file(Path(__file__).parents[2] / "docs" / "package_mixtures.py")
"""The script that writes the ensembles and devices into the package."""

# Equation (2.9) [uN/V^k], highest power first.
RISING, FALLING = (0.0016, -0.0255, -0.7057, 1.4796), (0.0076, -0.6062, -0.6350)


@pytest.mark.parametrize(
    ("name", "trained", "options"),
    [
        ("cantilever", 12, {"landing": {"capture", "restitute", "printed"}}),
        ("cantilever-1", 12, {"landing": {"capture", "restitute", "printed"}}),
        ("hexapod", 2, {"polarity": {"pressing", "lifting", "both"}, "average": {"apex", "time"}}),
    ],
)
def test_packaged_studies_are_whole_and_their_devices_lie_within_their_bounds(name, trained, options):
    described = load_study(name)
    lowered = lower_study(described, threads=1)
    assert len(lowered.trained) == trained
    assert {key: set(one.options) for key, one in described.study.choices.items()} == options
    device = ts.load_scene(name)
    unknowns = lowered.problem.unknowns
    for i, (key, one) in enumerate(described.study.unknowns.items()):
        for path in one.paths:
            assert unknowns.low[i] <= ts.get_value(device, path) <= unknowns.high[i], key
            origin = device.provenance.get(path) or device.provenance[path.rsplit(".", 1)[0]]
            assert origin.source.value == "calibrated", path


def loop(amplitude: float, samples: int = 400):
    """Voltages [V] of a closed loop from +amplitude down and up again, and whether each is on the rising branch."""
    down = np.linspace(amplitude, -amplitude, samples)
    return np.concatenate([down, down[::-1]]), np.repeat([False, True], samples)


def columns(law: ts.drives.PrandtlIshlinskii, amplitude: float):
    """Force [N] of the monomials and of a unit play at each threshold along a loop (2 samples, 4 + plays)."""
    volts, rising = loop(amplitude)
    bare = {"constant": 0.0, "linear": 0.0, "quadratic": 0.0, "cubic": 0.0}
    plays = []
    for r in law.thresholds:
        unit = law.model_copy(update={**bare, "thresholds": (r,), "weights": (1.0,)})
        plays.append(unit.force(np.concatenate([[amplitude, -amplitude, amplitude], volts]))[3:])
    return np.column_stack([np.ones_like(volts), volts, volts**2, volts**3, *plays]), volts, rising


@pytest.mark.parametrize("place", [0, 7, 14])
def test_the_loop_of_the_cantilevers_is_the_closed_operator_nearest_to_the_printed_branches(place):
    law = ts.load_scene("cantilever").robot.drives["pzt"].law
    wide, volts, rising = columns(law, 8.0)
    narrow = columns(law, 6.0)[0]
    target = np.where(rising, np.polyval(RISING, volts), np.polyval(FALLING, volts))
    table = loop_table()
    half_loop = 0.5 * (narrow[len(volts) // 2] - narrow[0])  # half the force swing of a 6 V loop, held hard
    low = np.full(wide.shape[1], -np.inf)
    high = np.concatenate([np.full(4, np.inf), np.zeros(len(law.thresholds))])
    swing = table["swing"][place]
    fitted = lsq_linear(np.vstack([wide, 30.0 * half_loop]), np.append(target, 30.0 * swing), (low, high)).x
    names = ["c0", "c1", "c2", "c3", *(f"w{p}" for p in range(len(law.thresholds)))]
    assert [table[name][place] for name in names] == pytest.approx(fitted.tolist(), abs=2e-6)


def test_the_device_of_the_model_s_column_repeats_it_better_than_that_of_the_measured_one():
    own, other = (
        {
            row["quantity"]: row
            for row in reproduce_cantilever(name).to_dict()["Figures of merit, as in Table 2.3"]
            if row["model"] == "this model, against the dissertation"
        }
        for name in ("cantilever-1", "cantilever")
    )
    for name in ("bounces per period", "peak after break-off", "contact per period"):
        assert own[name]["its size"] < other[name]["its size"]


def test_the_best_hexapod_makes_no_contact_over_20_to_40_um_at_3_to_10_v():
    """Section 3.4.3; the study asks it of two corners at the highest voltage."""
    device = ts.load_scene("hexapod")
    for printed in printed_rows("hexapod")[:2]:
        scene = row_scene(device, printed.conditions)
        gaps, shares = (axis.ravel() for axis in np.meshgrid([20e-6, 30e-6, 40e-6], [0.3, 0.6, 1.0]))
        drive = scene.signals["pzt"]
        vary = {
            "robot.feet.foot1.gap": gaps,
            "signals.pzt.amplitude": shares * drive.amplitude,
            "signals.pzt.offset": shares * drive.offset,
        }
        batch = ts.simulate_batch(scene, vary, 0.5, accuracy=ts.Accuracy(gap=1e-7))
        for n in range(len(gaps)):
            assert window_statistics(batch.run(n), 0.2, 0.3)["impacts"].value == 0.0, (gaps[n], shares[n])


@pytest.mark.parametrize("name", ["cantilever", "hexapod"])
def test_a_packaged_mixture_is_that_of_the_packaged_study_and_table(name):
    """A study that was changed without `python docs/package_mixtures.py` fails here."""
    texts = frozen_texts(load_study(name))
    file = files("tarsus_reproduce").joinpath("data", f"{name}_mixture.json")
    packaged = json.loads(file.read_text(encoding="utf-8"))
    for text in ("study.py", "table.csv"):
        told = packaged[f"{text.split('.')[0]}_sha256"]
        assert told == hashlib.sha256(texts[text].encode()).hexdigest(), text


@pytest.mark.parametrize("name", ["cantilever", pytest.param("hexapod", marks=pytest.mark.slow)])
def test_members_of_a_packaged_mixture_err_today_as_their_file_says(name):
    """Medians over all members and windows by this engine; an engine that moves them asks for a new calibration."""
    file = files("tarsus_reproduce").joinpath("data", f"{name}_mixture.json")
    packaged = json.loads(file.read_text(encoding="utf-8"))
    whole = packaged_ensemble(name)
    problem = whole.lowered.problem
    cells, values, weights = problem.objective.cells, [], []
    for weight, one in zip(whole.weights, whole.ensembles, strict=True):
        sets = problem.unknowns.values(one.points)
        found = np.asarray(problem.simulate(one.hypothesis.run, sets, range(problem.trained)), dtype=float)
        values.append(np.nan_to_num(found[:, :, list(one.hypothesis.columns)]))
        weights.append(weight * one.weights)
    every, share = np.concatenate(values), np.concatenate(weights)
    each = np.repeat(share, every.shape[-1])
    for k, measure in enumerate(cells.names):
        known = cells.observed[:, k] > 0.0
        medians = [weighted_quantile(every[:, n, k].ravel(), each, 0.5) for n in np.flatnonzero(known)]
        error = np.abs(np.array(medians) / cells.observed[known, k] - 1.0).mean()
        told = packaged["errors"]["training"]["measures"][measure]["mean_relative_error"]
        assert error == pytest.approx(told, abs=0.05 if measure != "bounces" else 0.3), measure


@pytest.mark.slow
def test_the_best_set_of_a_calibration_becomes_its_device_and_keeps_what_was_known_of_it(tmp_path, monkeypatch):
    """A short calibration of the packaged study, and the file that the package would get."""
    described = load_study("cantilever")
    none = dict.fromkeys(("short", "generations", "local_search", "spread"), 0)
    plan = {"prescreening": 5, "population": 5, "members": 4, "leave_out": False, **none}
    search = described.study.search.model_copy(update=plan)
    study = described.study.model_copy(update={"search": search, "train": (1, 2)})
    found = ts.calibrate(replace(described, study=study), tmp_path / "out", threads=1)
    device, before = PACKAGE.fitted_device("cantilever", tmp_path / "out"), ts.load_scene("cantilever")
    fit = found.solution.fit
    for one in fit.best.ranges(found.lowered.problem.unknowns):
        for path in study.unknowns[one.name].paths:
            assert ts.get_value(device, path) == pytest.approx(one.value, rel=1e-5)
    low, high = device.interval("ground.restitution.coefficient") or (1.0, 0.0)
    assert low <= ts.get_value(device, "ground.restitution.coefficient") <= high
    assert device.robot.feet == before.robot.feet and device.ground.film == before.ground.film
    rule = device.provenance["ground.landing"].note
    weight = fit.weights[int(np.argmin([one.best for one in fit.ensembles]))]
    assert f"weight {weight:.2f}" in rule and rule.startswith("`tarsus calibrate cantilever`")
    packaged = PACKAGE.mixture_file(tmp_path / "out")
    assert packaged["branches"][0]["members"][0]["unknowns"].keys() == study.unknowns.keys()
    told = " ".join(packaged["notes"])
    assert "landing, by weight: " in told and "Known besides the table: the tip leaves the ground" in told
    assert study.constraints[0].reason in told and study.choices["landing"].meaning in told
