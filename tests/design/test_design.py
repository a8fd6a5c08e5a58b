"""The grammar of designs: what is free, an objective, limits, grounds and a risk, judged as plain runs judge it."""

from __future__ import annotations

import json

import numpy as np
import pytest

import tarsus as ts
from tarsus.base.errors import InputError
from tarsus.design.free import free_of
from tarsus.design.measures import DEFINITIONS
from tarsus.design.problem import DesignSettings
from tarsus.design.request import settings_of
from tarsus.measure.measure import Scope
from tarsus.measure.periods import PER_WINDOW, PerWindow

GAP = "robot.feet.tip.gap"
DRIVE = {"signals.pzt.frequency": ("40 Hz", "60 Hz"), "signals.pzt.amplitude": ("6 V", "8 V")}
PULSES = {"signals.pzt": ts.design.Pulses("tip", pairs=1, tick=1e-6)}
FEW = {"candidates": 64, "look": 2, "threads": 1}


@pytest.fixture(scope="module")
def scene() -> ts.Scene:
    return ts.load_scene("cantilever")


@pytest.fixture(scope="module")
def drive(scene):
    """Frequency and amplitude of a drive, on two gaps that nobody knows."""
    over = ts.design.Grounds({GAP: np.array([69e-6, 71e-6])})
    limits = {"peak": ("<", "250 um")}
    return ts.design(scene, DRIVE, "most mean_apex", limits, over, ts.design.cvar(0.5), **FEW)


@pytest.fixture(scope="module")
def pulses(scene):
    """Switchings of an on-off signal with which a foot lands softer."""
    kept = {"duty_factor": ("<", 0.6), "mean_height": ("> 20 um")}
    return ts.design(scene, PULSES, "least hardest_impact.tip", kept, periods=6, **{**FEW, "candidates": 320})


def test_what_is_stated_is_what_plain_runs_measure(scene, drive):
    for one in (*drive.members, drive.optimum):
        run = ts.simulate(drive.scene_of(one))
        assert one.nominal[0] == pytest.approx(run.measures["mean_apex"].value, rel=1e-4)
        assert run.measures["peak"].value < 250e-6 and one.beyond == 0.0
        apexes = ts.simulate_batch(run.scene, {GAP: [69e-6, 71e-6]}).measure("mean_apex")
        assert one.risk[0] == pytest.approx(apexes.min(), rel=1e-4), "half of two grounds is the worse one"
        assert one.worst[0] == pytest.approx(min(apexes.min(), one.nominal[0]), rel=1e-4)
        assert one.motion.means["peak"] == pytest.approx(run.measures["peak"].value, rel=1e-4)
    usual = ts.simulate(scene).measures["mean_apex"].value
    assert drive.optimum.nominal[0] > 1.1 * usual
    assert drive.robust.risk[0] == max(one.risk[0] for one in (*drive.members, drive.optimum))


def test_every_design_says_what_a_percent_costs_and_has_files_and_a_page(drive, tmp_path):
    from tarsus.report.gait_page import gait_html

    costly = {one.name: one for one in drive.percents.each}
    assert {"robot.structure.frequencies.0", "robot.feet.*.gap"} <= costly.keys()  # of the gap it bears both values
    assert drive.percents.words in " ".join(drive.table().notes)
    drive.write(tmp_path)
    table = json.loads((tmp_path / "designs.json").read_text())
    assert table["front"][0]["values"] == dict(drive.robust.values) and table["risk"] == "cvar 0.5"
    again = ts.read_scene(tmp_path / "designs" / "robust.toml")
    assert again.signals["pzt"].frequency == drive.robust.values["signals.pzt.frequency"]
    assert "design-01" in gait_html(drive) and not (tmp_path / "gait.h").exists()


def test_pulses_of_a_signal_soften_the_hardest_touchdown(scene, pulses):
    plain = ts.simulate(scene, 0.32).measures["hardest_impact"].value
    signal = pulses.scene_of(pulses.robust).signals["pzt"]
    run = ts.simulate(pulses.scene_of(pulses.robust), 0.32)
    assert pulses.robust.nominal[0] < 0.4 * plain
    assert run.measures["hardest_impact"].value == pytest.approx(pulses.robust.nominal[0], rel=1e-2)
    assert pulses.robust.beyond == 0.0 and run.measures["duty_factor"].value < 0.6
    ticks = np.array(signal.durations) / 1e-6
    assert np.abs(ticks - np.rint(ticks)).max() < 1e-6 and sum(signal.durations) == pytest.approx(0.02)
    assert all(round(1e3 * volts) == pytest.approx(1e3 * volts) for volts in signal.levels)


def test_the_signal_without_pulses_is_the_step(scene):
    free = free_of(scene, PULSES)
    own, padded = (
        ts.with_values(scene, {"signals.pzt": wave})
        for wave in (ts.OnOff(levels=(8.0, -8.0), durations=(0.01, 0.01), repeat=True), free.scene.signals["pzt"])
    )
    assert free.families == 3 and len(free) == 5
    speeds = [ts.simulate(one, 0.1).measures["hardest_impact"].value for one in (own, padded)]
    assert speeds[0] == pytest.approx(speeds[1], rel=1e-9)


def test_a_file_says_the_same_as_a_call(scene, drive, tmp_path):
    file = tmp_path / "drive.toml"
    file.write_text(
        'scene = "cantilever"\nobjective = "most mean_apex"\nrisk = { cvar = 0.5 }\n[free.signals.pzt]\n'
        'frequency = ["40 Hz", "60 Hz"]\namplitude = ["6 V", "8 V"]\n[limits]\npeak = "< 250 um"\n'
        "[search]\ncandidates = 64\nlook = 2\n"
    )
    found = ts.design(request=file, over=drive.request.over, threads=1)
    assert found.robust.values == drive.robust.values and np.array_equal(found.costs, drive.costs)
    given = tmp_path / "pulses.toml"
    given.write_text('[free."signals.pzt"]\nfoot = "tip"\npairs = 1\nlevels = { from = "-8 V", to = "8 V" }\n')
    told = settings_of(DesignSettings, given, objective="least peak").free
    assert free_of(scene, told).pulses == free_of(scene, PULSES).pulses


def test_a_gait_is_a_design_of_a_walker():
    walker = ts.load_scene("millipede-printed")
    given = {**FEW, "from_rest": 0.01}
    free = {"gait.duty": None, "gait.frequency": ("100 Hz", "200 Hz")}
    found = ts.design(walker, free, "most mean_speed", **given)
    preset = ts.design.gait(walker, free, "speed", **given)
    assert np.array_equal(found.costs, preset.costs) and found.request.noun == "gait"
    assert found.robust.values == preset.robust.values


def test_own_measures_are_objectives(scene, monkeypatch):
    lasting = PerWindow("1", Scope.MEAN, "share", of=lambda seen: seen.of("duty_factor"))
    monkeypatch.setitem(PER_WINDOW, "share_held", lasting)
    assert DEFINITIONS["share_held"] is lasting
    found = ts.design(scene, DRIVE, "least share_held", **FEW)
    run = ts.simulate(found.scene_of(found.robust))
    assert found.robust.nominal[0] == pytest.approx(run.measures["duty_factor"].value, rel=1e-4)


def test_a_design_without_a_value_says_so(scene):
    """A tip five times as wide and more never strikes, so that no flight has an apex."""
    found = ts.design(scene, {"robot.structure.tip_width": ("0.5 mm", "3 mm")}, "most mean_apex", **FEW)
    assert np.isnan(found.robust.nominal[0]) or np.isinf(found.robust.nominal[0])
    assert "design-01: its motion has no mean apex" in found.remarks and found.percents.each == ()


WRONG = [
    ({"free": {"signals.pzt.frequncy": ("1 Hz", "2 Hz")}}, "did you mean 'signals.pzt.frequency'"),
    ({"free": {}}, "name at least one number"),
    ({"free": {"signals.motor": ts.design.Pulses("tip")}}, "pulses are of the signal of a drive"),
    ({"free": {"signals.pzt": {"foot": "tip", "pears": 1}}}, "did you mean 'pairs'"),
    ({"free": {"signals.pzt": ts.design.Pulses("tip", levels={"from": 1})}}, "expected {from = low, to = high}"),
    ({"objective": "most mean_speed"}, "'cantilever' does not walk"),
    ({"objective": "most peak.toe"}, "the robot has no foot 'toe'"),
    ({"objective": "peak"}, "say whether the most or the least is best"),
    ({"risk": "cvar:0.9", "over": {GAP: (69e-6, 71e-6)}}, "is {cvar = 0.9}"),
    ({"over": {"signals.pzt.amplitude": (6.0, 8.0)}}, "is designed, so it cannot be"),
    ({"periods": 4, "starts": 2}, "leave starts out"),
    ({"scene": None}, "scene: name a device"),
]


@pytest.mark.parametrize(("changes", "said"), WRONG)
def test_a_bad_design_gets_one_sentence(scene, changes, said):
    asked = {"scene": scene, "free": DRIVE, "objective": "least peak", **changes}
    with pytest.raises(InputError) as refused:
        ts.design(asked.pop("scene"), **asked)
    assert len(refused.value.problems) == 1 and said in refused.value.problems[0]
