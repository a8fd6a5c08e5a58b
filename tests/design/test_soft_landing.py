"""Soft touchdown: what a design says of itself, again by other means; and how good it is."""

from __future__ import annotations

import json
import re
import subprocess
from dataclasses import replace

import numpy as np
import pytest

import tarsus as ts
from tarsus.base.errors import InputError
from tarsus.base.events import IMPACTS
from tarsus.base.spec import get_value
from tarsus.design.descent import settled
from tarsus.design.grounds import over_of, spread
from tarsus.design.headers import header_text
from tarsus.design.landing import LandingSettings, landing_problem
from tarsus.design.landing_design import signal_text
from tarsus.design.learning import Sensor, learn
from tarsus.files.toml import parse_scene, read_scene, scene_text
from tarsus.model.scene import Provenance, Source
from tarsus.orbits.starts import Box

GAP = "robot.feet.tip.gap"
BOX = {GAP: ("66 um", "74 um"), "ground.restitution.coefficient": (0.15, 0.5)}
CAPACITANCE = {"robot.drives.pzt.capacitance": 664e-12}


@pytest.fixture(scope="module")
def scene():
    return ts.with_values(ts.load_scene("cantilever"), CAPACITANCE)


@pytest.fixture(scope="module")
def quick(scene):
    """A design of little effort: of its numbers everything must hold but that they are the best."""
    return ts.design.landing(scene, "tip", pairs=1, levels="free=-8V:8V", effort=0.03, seed=1, risk="nominal")


def test_the_square_wave_is_what_the_plain_step_is(scene, quick):
    run = ts.simulate_batch(scene, {GAP: [70e-6]}, 0.4)
    assert quick.before.speed[0, 0] == pytest.approx(run.measure("hardest_impact")[0], rel=1e-6)
    assert quick.before.touchdowns[0, 0] == run.measure("impacts")[0]
    assert quick.before.contact[0, 0] == pytest.approx(run.measure("contact_duration")[0], rel=1e-6)


def test_the_speed_is_that_of_a_single_run_of_the_designed_scene(quick):
    run = ts.simulate(quick.scene, 0.32)
    events = run.events
    last = events[np.isin(events["kind"], IMPACTS) & (events["time"] > 0.30)]
    assert quick.speed == pytest.approx(last["speed_before"].max(), rel=1e-4)
    assert quick.touchdowns == len(last)
    lost = last["speed_before"] - last["speed_after"]
    assert quick.after.impulse[0, 0] == pytest.approx((2.0 * last["energy"] / lost).max(), rel=1e-4)
    assert quick.speed < 0.5 * quick.before.speed[0, 0] and quick.found.robust.motion.words == "repeats"


def test_other_starts_are_told_and_are_those_of_single_runs(quick):
    told = quick.to_dict()["put_down"]
    assert told["starts"] == len(quick.put_down) == 48 and told["share_95"][0] < told["share"] <= told["share_95"][1]
    assert any("placed differently" in note for note in quick.table().notes)
    assert any("volts: from −8 V to 8 V" in note for note in quick.table().notes)
    box = Box.of(quick.scene, None)
    values = box.values(box.drawn(48, 0))
    for r in (0, 7):
        start = ts.with_values(box.scene, {path: float(each[r]) for path, each in values.items()})
        events = ts.simulate(start, 0.64).events
        late = events[np.isin(events["kind"], IMPACTS) & (events["time"] > 0.48)]
        assert quick.put_down[r] == pytest.approx(late["speed_before"].max(), rel=1e-4)


def test_the_step_is_kept(quick):
    assert quick.after.contact[0, 0] >= 0.8 * quick.before.contact[0, 0]
    assert quick.after.lifted[0, 0] >= 0.8 * quick.before.lifted[0, 0]
    assert sum(quick.signal.durations) == pytest.approx(0.02, rel=1e-12)
    assert max(quick.signal.levels) == 8.0 and min(quick.signal.levels) == -8.0


def test_one_percent_of_a_number_costs_what_runs_beside_say(quick):
    """Slopes are those of single runs 0.01 % to both sides, with half of what the sides differ by: a speed that is the
    root of an energy bends within less than that where it is small. The worst is that of runs a percent to a side."""
    told, frequency, gap = quick.percents, "robot.structure.frequencies.0", "robot.feet.*.gap"
    each = {one.name: one for one in told.each}
    assert told.each[0].name == frequency and told.own == pytest.approx(quick.speed, rel=1e-6)

    periods = quick.request.motion.periods

    def hardest(path: str, share: float) -> float:
        value = get_value(quick.scene, path) * (1.0 + share)
        events = ts.simulate(ts.with_values(quick.scene, {path: value}), periods * 0.02).events
        late = events["time"] > (periods - 1) * 0.02
        return events["speed_before"][np.isin(events["kind"], IMPACTS) & late].max()

    for name, path in ((frequency, frequency), (gap, GAP)):
        below, own, above = (hardest(path, share) for share in (-1e-4, 0.0, 1e-4))
        assert each[name].slope == pytest.approx(50.0 * (above - below), rel=1e-3, abs=1e-3 * quick.speed)
        assert each[name].error == pytest.approx(
            abs(50.0 * (above + below - 2.0 * own)), rel=1e-3, abs=1e-3 * quick.speed
        )
        assert each[name].worst >= max(hardest(path, -0.01), hardest(path, 0.01)) * (1.0 - 1e-4)
    assert told.box >= max(one.worst for one in told.each) and told.words in " ".join(quick.table().notes)
    assert quick.to_dict()["percents"]["each"][0] == told.each[0].to_dict()


def test_a_landing_bears_the_frequencies_unless_something_else_is_said(scene):
    """Each within the interval that it states, else within a percent."""
    names = [f"robot.structure.frequencies.{i}" for i in (0, 1)]
    told = Provenance(source=Source.PRINTED, note="n", interval=((620.0, 630.0), (6000.0, 6500.0)))
    known = ts.with_values(scene, {"provenance": {"robot.structure.frequencies": told}})
    bare = ts.with_values(scene, {"provenance": {}})
    for given, own, wanted in (
        (bare, {}, [(616.77, 629.23), (6359.76, 6488.24)]),
        (known, {}, [(620.0, 630.0), (6000.0, 6500.0)]),
        (known, {"risk": "nominal"}, None),
        (known, {"over": {GAP: ("66 um", "74 um")}}, [(66e-6, 74e-6)]),
    ):
        asked, _ = landing_problem(given, LandingSettings(foot="tip", **own))
        assert (asked.over is None) == (wanted is None) == (asked.risk.name == "nominal")
        if wanted and asked.over is not None:
            assert asked.over.names == tuple(names if not own else [GAP])
            assert np.stack([asked.over.low, asked.over.high], axis=1) == pytest.approx(np.array(wanted))


def test_the_table_has_what_is_promised(quick):
    table = quick.to_dict()
    assert len(table["switching_times"]) == len(table["levels"]) and table["switching_times"][0] == 0.0
    ticks = np.array(table["switching_times"]) / table["tick"]
    assert np.allclose(ticks, np.rint(ticks), atol=1e-6)
    assert table["energy"] > 0.0 and table["energy_recovered"] == pytest.approx(table["energy"] / 3.0)
    assert table["scenarios"][0]["speed"] == pytest.approx(table["speed"]) and np.isnan(table["worst"])


def test_the_files_hold_the_signal_for_any_scene(quick, scene, tmp_path):
    folder = quick.write(tmp_path / "design")
    assert read_scene(folder / "scene.toml").signals["pzt"] == quick.signal
    bare = ts.with_values(scene, {"provenance": {}})
    own = re.sub(r"\[signals\.pzt\][^\[]*", signal_text(quick) + "\n", scene_text(bare), count=1)
    signal = parse_scene(own).signals["pzt"]
    assert signal.durations == pytest.approx(quick.signal.durations, rel=1e-9)
    assert signal.levels == quick.signal.levels
    assert (folder / "landing.h").read_text() == header_text(quick)
    assert json.loads((folder / "landing.json").read_text())["worst"] is None


@pytest.mark.compiler
def test_a_compiler_takes_the_header_and_switches_as_designed(quick, tmp_path):
    (tmp_path / "landing.h").write_text(header_text(quick))
    program = '#include "landing.h"\n#include <stdio.h>\nint main(void) {\n'
    program += "  for (unsigned i = 0; i < LANDING_COUNT; ++i)\n"
    program += '    printf("%u %d ", landing_ticks[i], landing_millivolts[i]);\n  return 0;\n}\n'
    (tmp_path / "main.c").write_text(program)
    for words in (("cc", "-std=c99"), ("c++", "-x", "c++", "-std=c++17")):
        flags = ("-Wall", "-Wextra", "-pedantic", "-Werror", "main.c", "-o", "main")
        subprocess.run([*words, *flags], cwd=tmp_path, check=True)
        said = subprocess.run([tmp_path / "main"], capture_output=True, text=True).stdout.split()
        assert [int(word) for word in said[::2]] == [round(time / 1e-6) for time in quick.switching_times]
        assert [int(word) for word in said[1::2]] == [round(1e3 * volts) for volts in quick.signal.levels]


def test_no_name_ends_a_comment_of_a_signal(quick):
    named = quick.request.scene.model_copy(update={"name": "a */ #error\nlevels = 1"})
    design = replace(quick, found=replace(quick.found, request=replace(quick.request, scene=named)))
    assert signal_text(design).splitlines()[1] == "[signals.pzt]" and header_text(design).count("*/") == 1


def test_a_search_pays_for_no_more_periods_than_the_motion_takes_to_settle(scene):
    """What a candidate is after fewer periods is what it is after all; a tip that remembers takes longer."""
    quick, _ = landing_problem(scene, LandingSettings(foot="tip", pairs=1, risk="nominal"))
    few = settled(quick)
    rows = quick.free.values(np.random.default_rng(3).random((200, len(quick.free))))
    early, late = (one.runs().each(rows, {})[:, 0] for one in (few, quick))
    assert few.motion.periods < quick.motion.periods == 10
    assert np.mean(np.abs(early - late) <= 0.011 * late) > 0.85
    light = ts.with_values(scene, {"robot.structure.damping_ratios": (1e-4, 1e-4)})
    free = ts.with_values(light, {"ground.adhesion": None, "ground.landing": ts.laws.CaptureUnlessPulled()})
    fast = ts.with_values(free, {"signals.pzt.frequency": 400.0})
    slow = landing_problem(fast, LandingSettings(foot="tip", pairs=1, risk="nominal"))[0]
    assert settled(slow).motion.periods > few.motion.periods


def test_a_learner_is_told_nothing_of_its_ground_and_softens_its_steps(scene):
    over = {GAP: ("67 um", "73 um")}
    given = {"foot": "tip", "pairs": 1, "levels": "free=-8V:8V", "over": over, "risk": "nominal", "effort": 0.1}
    design = ts.design.landing(scene, **given, learn=12, sensor=Sensor.SPEED, seed=1)
    found = design.learning
    assert found.speeds.shape == (40, 13) and found.regret.shape == (40, 12)
    assert (np.diff(found.regret, axis=1) >= -1e-12).all() and (found.regret >= 0.0).all()
    assert found.halved >= 0.95
    assert np.median(found.speeds[:, 10]) < 0.5 * np.median(found.speeds[:, 0]) < 0.15 * np.median(found.plain)
    inside = found.grounds.values[GAP]
    assert inside.min() >= 67e-6 and inside.max() <= 73e-6


BAD = [
    ({"foot": "toe"}, "no foot 'toe'"),
    ({"levels": "-80 V, 80 V"}, "beyond the drive's law"),
    ({"levels": "8 V"}, "at least two"),
    ({"levels": "free=1V"}, "free=low:high"),
    ({"levels": "-0.2 V, 0.2 V"}, "never lands"),
    ({"pairs": 0}, "pairs"),
    ({"shortest": 0.003}, "shortest: 4 plateaus of 3 ms"),
    ({"levels": ("-8 V", "high")}, "expected a voltage"),
    ({"drive": "motor"}, "no drive 'motor'"),
    ({"sensor": "sound"}, "sensor"),
    ({"free": ("signals.pzt.duty",)}, "no switching time"),
]


@pytest.mark.parametrize(("changes", "said"), BAD)
def test_a_bad_request_gets_one_sentence(scene, changes, said):
    asked = {"foot": "tip", **changes}
    with pytest.raises(InputError, match=said) as refused:
        ts.design.landing(scene, **asked)
    assert len(refused.value.problems) == 1


def test_an_amplifier_bounds_the_levels(scene):
    clipped = ts.with_values(scene, {"robot.drives.pzt.amplifier": ts.Amplifier(clip=(-7.0, 7.0))})
    with pytest.raises(InputError, match="beyond the amplifier"):
        ts.design.landing(clipped, "tip")


def test_of_a_given_signal_only_the_free_switching_times_move(scene):
    own = ts.OnOff(levels=(8.0, -8.0, 8.0, -8.0), durations=(2e-4, 4e-4, 9.4e-3, 1e-2), repeat=True)
    given = ts.with_values(scene, {"signals.pzt": own})
    design = ts.design.landing(given, "tip", free=("signals.pzt.durations.1",), effort=0.012, risk="nominal")
    assert design.signal.levels == own.levels and sum(design.signal.durations) == pytest.approx(0.02, rel=1e-12)
    first, moved, held, last = design.signal.durations
    assert abs(first - 2e-4) < 3e-6 and abs(held - 9.4e-3) < 3e-6 and abs(moved + last - 1.04e-2) < 3e-6
    assert moved != pytest.approx(4e-4, rel=1e-3) and design.speed < design.before.speed[0, 0]


@pytest.mark.slow
def test_the_default_design_bears_both_frequencies(scene):
    """A percent to either side of both: what is stated holds on thirty own grounds, in plain runs."""
    design = ts.design.landing(scene, "tip", seed=1)
    box = design.request.over
    points = box.values(np.random.default_rng(4).random((30, len(box))))
    batch = ts.simulate_batch(
        design.scene,
        {path: points[:, i] for i, path in enumerate(box.names)},
        0.02 * (design.request.motion.periods + 1),
    )
    hardest = batch.measure("hardest_impact", skip=design.request.motion.periods)
    assert design.worst <= 0.06 and hardest.max() <= 1.02 * design.worst


@pytest.mark.slow
def test_the_wanted_speeds_of_the_cantilever(scene):
    for pairs, levels in ((2, "-8 V, 8 V"), (1, "free=-8V:8V"), (2, "free=-8V:8V")):
        found = ts.design.landing(scene, "tip", pairs=pairs, levels=levels, seed=1, risk="nominal")
        assert found.speed <= 0.03 and found.touchdowns <= 2.0


@pytest.mark.slow
@pytest.mark.parametrize(("levels", "most", "rival"), [("-8 V, 8 V", 0.08, 2.0), ("free=-8V:8V", 0.04, 2.5)])
def test_no_ground_of_a_hundred_thousand_is_two_percent_worse(scene, levels, most, rival):
    """The worst of the robust design is what its search asks for; which of its many valleys it ends in is chance: with
    listed levels the worst is 0.049 to 0.077 m/s with seeds 1 to 4. How hard the design
    for the own ground strikes in the box nothing asks for."""
    design = ts.design.landing(scene, "tip", pairs=2, levels=levels, over=BOX, seed=1)
    assert design.worst <= most and design.nominal_worst >= rival * design.worst
    box = over_of(scene, BOX)
    points = spread(box, 100_000, seed=77)
    batch = ts.simulate_batch(
        design.scene,
        {path: points[:, i] for i, path in enumerate(box.names)},
        0.02 * (design.request.motion.periods + 1),
    )
    assert batch.measure("hardest_impact", skip=design.request.motion.periods).max() <= 1.02 * design.worst


@pytest.mark.slow
@pytest.mark.parametrize("seed", [1, 2, 3])
@pytest.mark.parametrize("effort", [0.01, 0.3])
@pytest.mark.parametrize(("levels", "pairs"), [("free=-8V:8V", 1), ("-8 V, 8 V", 1), ("-8 V, 8 V", 2)])
def test_learners_halve_the_plain_speed_on_hidden_grounds(scene, levels, pairs, effort, seed):
    given = {"foot": "tip", "pairs": pairs, "levels": levels, "over": BOX, "risk": "nominal", "seed": seed}
    design = ts.design.landing(scene, **given, effort=effort)
    for sensor in Sensor:
        assert learn(design, 10, sensor, hidden=200).halved >= 0.95
