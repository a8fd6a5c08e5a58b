import pytest

from tarsus.base.errors import InputError
from tarsus.base.spec import with_values
from tarsus.files.library import load_scene
from tarsus.files.toml import description_text, parse_scene, scene_text
from tarsus.model.scene import Provenance, Source, override, provenance_problems

GAP, RATIOS = "robot.feet.tip.gap", "robot.structure.damping_ratios"


def with_intervals(**intervals):
    """The cantilever with intervals for its gap and damping ratios."""
    device = load_scene("cantilever")
    given = {
        path: Provenance(source=Source.CALIBRATED, note="For this test.", interval=interval)
        for path, interval in ((GAP, intervals.get("gap")), (RATIOS, intervals.get("ratios")))
    }
    return with_values(device, {"provenance": {**device.provenance, **given}})


def test_one_pair_is_the_interval_of_one_value_and_a_list_has_one_each() -> None:
    scene = with_intervals(gap=(60e-6, 80e-6), ratios=[(0.01, 0.02), (0.08, 0.1)])
    assert scene.interval(GAP) == (60e-6, 80e-6)
    assert scene.interval(f"{RATIOS}.1") == (0.08, 0.1)
    assert scene.interval("ground.film.thickness") is None
    assert provenance_problems(scene) == []


def test_intervals_survive_the_file_and_leave_with_a_changed_value() -> None:
    scene = with_intervals(gap=(60e-6, 80e-6), ratios=[(0.01, 0.02), (0.08, 0.1)])
    again = parse_scene(scene_text(scene))
    assert again == scene
    assert again.interval(GAP) == (60e-6, 80e-6)
    assert override(scene, {GAP: "75 um"}).interval(GAP) is None


def test_a_star_stands_for_any_one_name() -> None:
    device = load_scene("cantilever")
    tip, feet = (Provenance(source=Source.DERIVED, note=note) for note in ("This one.", "Any foot."))
    scene = with_values(device, {"provenance": {"robot.feet.*.gap": feet, "robot.*.pzt": feet}})
    assert scene.origin("robot.feet.tip.gap") == feet
    assert scene.origin("robot.drives.pzt.law.linear") == feet
    assert scene.origin("robot.structure.length") is None and scene.origin("robot.feet.tip.normal") is None
    assert provenance_problems(scene) == []
    assert parse_scene(scene_text(scene)) == scene
    named = with_values(scene, {"provenance": {**scene.provenance, "robot.feet.tip": tip, GAP: tip}})
    assert named.origin(GAP) == tip
    changed = override(scene, {GAP: "75 um"})
    assert changed.origin(GAP) == Provenance(source=Source.ASSUMED, note="Set by the user; was 70 um (derived).")
    assert changed.origin("robot.drives.pzt.law.linear") == feet
    assert "robot.feet.*.gap" in changed.provenance
    interval = Provenance(source=Source.DERIVED, note="Any foot.", interval=((6e-5, 8e-5),))
    within = with_values(device, {"provenance": {"robot.feet.*.gap": interval}})
    assert within.interval(GAP) == (6e-5, 8e-5) and provenance_problems(within) == []
    wrong = with_values(device, {"provenance": {"robot.feet.*.gaps": tip, "robot.*.pzt": interval}})
    assert provenance_problems(wrong) == [
        "provenance.robot.feet.*.gaps: stands for no path of the scene",
        "provenance.robot.*.pzt.interval: expected 21 (low, high), one for each number, got 1",
    ]


def test_refused() -> None:
    with pytest.raises(InputError, match="starts at its lower end, got 2 to 1"):
        Provenance(source=Source.PRINTED, note="No.", interval=((2.0, 1.0),))
    with pytest.raises(InputError):
        Provenance(source=Source.PRINTED, note="No.", interval=((1.0, float("nan")),))
    wrong = with_intervals(ratios=[(0.01, 0.02)])
    assert provenance_problems(wrong) == [
        f"provenance.{RATIOS}.interval: expected 2 (low, high), one for each number, got 1"
    ]
    with pytest.raises(InputError, match="expected 2"):
        parse_scene(description_text(wrong))


def test_what_is_switched_off_is_written() -> None:
    scene = load_scene("hexapod", **{"ground.impact.passive": False})
    assert parse_scene(scene_text(scene)).ground.impact.passive is False
