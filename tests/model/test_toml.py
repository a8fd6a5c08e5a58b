from pathlib import Path

import pytest

from tarsus.base.errors import InputError
from tarsus.base.spec import with_values
from tarsus.files.library import load_scene
from tarsus.files.toml import parse_scene, read_scene, scene_text, write_scene
from tarsus.model.laws import load_laws

BALL = """
name = "ball"
duration = "3 s"

[robot.structure]
kind = "lumped"
coordinates = ["ball"]
mass = "1 g"
stiffness = 0

[robot.feet.ball]
point = "ball"
gap = 0

[ground]
gravity = {}
restitution = { coefficient = "90 %" }

[initial]
displacement = ["1 m"]
"""

LAW = """
from tarsus.model.laws import SmoothLaw
from tarsus.base.spec import quantity


class Magnet(SmoothLaw):
    pull: float = quantity("N", "pull in contact", ge=0)

    def force(gap, gap_rate, volts, time, pull):
        return -pull
"""


def problems(text: str, **options: object) -> list[str]:
    with pytest.raises(InputError) as caught:
        parse_scene(text, **options)  # type: ignore[arg-type]
    return caught.value.problems


def test_a_signal_of_another_kind_leaves_no_provenance_that_cannot_be_read() -> None:
    sine = {"kind": "sine", "amplitude": 5.0, "offset": 5.0, "frequency": 134.0, "phase": 0.0}
    changed = with_values(load_scene("hexapod"), {"signals.pzt": sine})
    again = parse_scene(scene_text(changed))
    assert again.signals == changed.signals and again.robot == changed.robot
    assert "signals.pzt.amplitude" in again.provenance and "signals.pzt.duty" not in again.provenance


WALKER = """
name = "mine"
duration = "0.2 s"
[robot.structure]
kind = "walker"
body = { mass = "1 g", length = "20 mm" }
[robot.structure.legs.LF]
mass = "5 mg"
stiffness_v = "100 N/m"
damping_v = "1 mN s/m"
stiffness_l = "100 V"
[gait]
kind = "trot"
frequency = "50 Hz"
amplitude = "20 V"
[provenance]
"robot.structure.legs.*.mas" = { source = "assumed", note = "A guess." }
"""


def test_faults_behind_faults_are_found_at_once() -> None:
    """Of parts, of wholes whose parts are wrong, of what hangs on those wholes, and of the provenance."""
    said = problems(WALKER)
    found = dict(one.split(": ", 1) for one in said)
    assert set(found) == {
        "robot.structure.legs.LF.stiffness_l",
        "robot.structure.legs.LF.damping_l",
        "gait.kind",
        "gait.high",
        "gait.amplitude",
        "robot.feet",
        "gait",
        "provenance.robot.structure.legs.*.mas",
    }
    assert "did you mean 'alternating'?" in found["gait.kind"] and "did you mean 'high'?" in found["gait.amplitude"]
    assert "no drive of the robot moves a leg" in found["gait"]


@pytest.mark.parametrize(
    ("text", "hidden"),
    [
        ('[robot.structure]\nkind = "modal"\ndamping_ratios = [0.1]\nmodal_masses = ["1 mg"]', "expected 1"),
        ('[robot.feet.tip]\ngap = "1 um"\n[robot.structure]\nkind = "walker"', "has no point"),
        ('[gait]\nkind = "alternating"\nlow = "5 V"\nfrequency = "1 Hz"', "below the lower one"),
    ],
)
def test_nothing_is_said_of_what_is_not_given(text: str, hidden: str) -> None:
    """Stand-ins for missing names, sizes and numbers have no faults of their own."""
    said = problems(f'name = "it"\n{text}\n')
    assert any("missing; " in one for one in said) and not any(hidden in one for one in said)


def test_wrong_points_are_found_beside_other_errors() -> None:
    text = BALL.replace('point = "ball"', 'point = "bal"').replace('duration = "3 s"', 'duration = "3 m"')
    assert sorted(problems(text)) == [
        "duration: expected a time (s), got '3 m', which is a length (time to simulate unless another is asked for)",
        "robot.feet.ball.point: the structure has no point 'bal'; did you mean 'ball'?",
    ]


@pytest.mark.parametrize("text", ["", "name = 3", "robot = 3", "robot = []\nsignals = 3", "[robot]\nfeet = 'a'"])
def test_nonsense_is_an_input_error(text: str) -> None:
    assert problems(text)


def test_provenance_of_nothing() -> None:
    text = BALL + '[provenance]\n"ground.film.thickness" = { source = "printed", note = "T" }\n'
    assert problems(text) == [
        "provenance.ground.film.thickness: 'ground.film' is not set here, so 'thickness' has nothing to act on"
    ]
    text = BALL + '[provenance]\nduratio = { source = "guessed", note = "" }\n'
    said = problems(text)
    assert said[0].startswith(
        "provenance.duratio.source: expected 'printed', 'derived', 'calibrated', 'assumed' or 'designed'"
    )
    text = BALL + '[provenance]\nduratio = { source = "printed", note = "T" }\n'
    assert problems(text) == ["provenance.duratio: unknown path; did you mean 'duration'?"]


def test_user_laws_in_a_file(tmp_path: Path) -> None:
    (tmp_path / "law.py").write_text(LAW)
    laws = load_laws(tmp_path / "law.py")
    text = BALL + '[ground.laws.magnet]\npull = "3 uN"\n[ground.laws.other]\nkind = "magnet"\npull = "1 uN"\n'
    it = parse_scene(text, laws=laws)
    assert it.ground.laws["other"] == laws["magnet"](pull=1e-6)
    assert parse_scene(scene_text(it), laws=laws) == it
    assert problems(text)[0] == (
        "ground.laws.magnet: no law of kind 'magnet' is known; give the file that defines it (--law FILE.py)"
    )
    wrong = text.replace('pull = "1 uN"', "pull = -1")
    assert problems(wrong, laws=laws) == [
        "ground.laws.other.pull: expected a force (N) of at least 0, got -1.0 (pull in contact)"
    ]


def test_files_named_in_a_scene_are_found_beside_it(tmp_path: Path) -> None:
    folder = tmp_path / "somewhere"
    folder.mkdir()
    (folder / "volts.csv").write_text("time,volts\n0,0\n0.1,8\n")
    it = with_values(load_scene("cantilever"), {"provenance": {}})
    text = scene_text(it).replace(
        scene_text(it)[scene_text(it).index("[signals.pzt]") :], '[signals.pzt]\nkind = "sampled"\nfile = "volts.csv"\n'
    )
    (folder / "it.toml").write_text(text)
    scene = read_scene(folder / "it.toml")
    write_scene(scene, tmp_path / "copy.toml")
    assert read_scene(tmp_path / "copy.toml") == scene
