import math

import numpy as np
import pytest

from effort import calls
from tarsus.base.errors import InputError
from tarsus.base.spec import float_paths, quantity, with_values
from tarsus.files.library import load_scene
from tarsus.model.drive.laws import LinearForce
from tarsus.model.drive.waveforms import Sine
from tarsus.model.laws import Electrostatic, Film, Gravity, Restitution, SmoothLaw
from tarsus.model.scene import (
    Drive,
    Foot,
    Ground,
    InertiaLoad,
    Initial,
    ModalLoad,
    PointLoad,
    Provenance,
    Robot,
    Scene,
    Source,
    override,
)
from tarsus.model.structure import Lumped, Modal


def chain(**changes: object) -> Lumped:
    values = {"coordinates": ["tip", "base"], "mass": [1e-6, 2e-6], "stiffness": [[2.0, -2.0], [-2.0, 5.0]]}
    return Lumped(**{**values, **changes})


def robot(**changes: object) -> Robot:
    values = {
        "structure": chain(),
        "drives": {"pzt": Drive(load=PointLoad(weights={"base": 1.0}), law=LinearForce(gain="1 uN/V"))},
        "feet": {"toe": Foot(point="tip", gap="70 um")},
    }
    return Robot(**{**values, **changes})


def scene(**changes: object) -> Scene:
    values = {
        "name": "chain",
        "robot": robot(),
        "ground": Ground(restitution=Restitution(coefficient=0.4)),
        "signals": {"pzt": Sine(amplitude=8.0, frequency=50.0)},
        "duration": 0.1,
    }
    return Scene(**{**values, **changes})


def problems(build) -> list[str]:  # type: ignore[no-untyped-def]
    with pytest.raises(InputError) as caught:
        build()
    return caught.value.problems


def test_loads_are_generalised_forces() -> None:
    structure = chain(weights={"middle": [0.5, 0.5]})
    load = PointLoad(weights={"middle": 2.0, "tip": -1.0})
    np.testing.assert_allclose(load.vector(structure), [0.0, 1.0])
    np.testing.assert_allclose(ModalLoad(participation=[0.3, 0.4]).vector(structure), [0.3, 0.4])
    both = chain(upward=[1.0, 1.0], forward=[0.0, 0.5])
    per_acceleration = InertiaLoad(upward=-1.0, forward=2.0).vector(both)
    np.testing.assert_allclose(per_acceleration, both.matrices().mass @ [-1.0, 0.0])


@pytest.mark.parametrize(
    ("load", "said"),
    [
        (InertiaLoad(), "load: an inertia load needs a share"),
        (InertiaLoad(forward=1.0), "load.forward: needs the structure's own 'forward'"),
    ],
)
def test_an_inertia_load_needs_a_way(load: InertiaLoad, said: str) -> None:
    drive = Drive(load=load, law=LinearForce(gain=1.0))
    assert said in problems(lambda: robot(drives={"table": drive}))[0]


def places(build) -> list[str]:  # type: ignore[no-untyped-def]
    return [one.split(":")[0] for one in problems(build)]


def test_a_foot_below_the_ground_at_rest() -> None:
    assert "below ground at rest" in problems(lambda: Foot(point="tip", gap="-3 um"))[0]
    assert places(lambda: Foot(point="tip", gap=0.0, normal=2)) == ["Foot.normal"]
    assert "got nan" in problems(lambda: Foot(point="tip", gap=math.nan))[0]


def test_names_in_a_robot() -> None:
    assert places(
        lambda: robot(
            feet={"toe": Foot(point="tpi", gap=0.0, electrode="pzd")},
            drives={
                "pzt": Drive(load=PointLoad(weights={"bas": 1.0}), law=LinearForce(gain=1.0)),
                "two": Drive(load=ModalLoad(participation=[1.0]), law=LinearForce(gain=1.0)),
                "none": Drive(load=PointLoad(weights={}), law=LinearForce(gain=1.0)),
            },
        )
    ) == [
        "Robot.feet.toe.point",
        "Robot.feet.toe.electrode",
        "Robot.drives.pzt.load.weights.bas",
        "Robot.drives.two.load.participation",
        "Robot.drives.none.load.weights",
    ]


def test_names_and_lengths_in_a_scene() -> None:
    wrong = Initial(displacement=[0.0], velocity=[0.0])
    ptz = {"ptz": Sine(amplitude=1.0, frequency=1.0)}
    assert places(lambda: scene(signals=ptz, initial=wrong)) == [
        "Scene.signals.ptz",
        "Scene.initial.displacement",
        "Scene.initial.velocity",
    ]


def test_starting_below_the_ground() -> None:
    said = problems(lambda: scene(initial=Initial(displacement=["-71 um", "0 m"])))
    assert said[0].startswith("Scene.initial.displacement: foot 'toe' would start ")
    assert said[0].endswith(" below the ground")
    scene(initial=Initial(displacement=["-70 um", "0 m"]))
    upside_down = robot(feet={"toe": Foot(point="tip", gap="70 um", normal=-1)})
    scene(robot=upside_down, initial=Initial(displacement=["-71 um", "0 m"]))
    assert problems(lambda: scene(robot=upside_down, initial=Initial(displacement=["71 um", "0 m"])))


def test_gravity_needs_to_know_up() -> None:
    modal = Modal(frequencies=[0.0], damping_ratios=[0.0], modal_masses=[1.0], shapes={"tip": [1.0]})
    bare = robot(structure=modal, drives={})
    heavy = Ground(gravity=Gravity())
    assert places(lambda: scene(robot=bare, signals={}, ground=heavy)) == ["Scene.robot.structure.upward"]
    scene(ground=Ground(gravity=Gravity()))


def test_a_way_along_the_ground_is_not_the_foots_own_point() -> None:
    with pytest.raises(ValueError, match="'tip' is the foot's own point"):
        robot(feet={"toe": Foot(point="tip", gap=0.0, along="tip")})


def test_electrostatics_need_an_electrode() -> None:
    ground = Ground(electrostatic=Electrostatic(coefficient=1e-21, offset=1e-6))
    assert problems(lambda: scene(ground=ground))[0].startswith("Scene.ground.electrostatic: acts on no foot")
    scene(ground=ground, robot=robot(feet={"toe": Foot(point="tip", gap=0.0, electrode="pzt")}))


def test_user_laws_are_kept_by_name() -> None:
    class Magnet(SmoothLaw):
        pull: float = quantity("N", "pull", ge=0)

        @staticmethod
        def force(gap: float, gap_rate: float, volts: float, time: float, pull: float) -> float:
            return -pull

    it = scene(ground=Ground(laws={"magnet": Magnet(pull="3 uN")}))
    assert float_paths(it)["ground.laws.magnet.pull"].value == 3e-6
    changed = with_values(it, {"ground.laws.magnet.pull": 4e-6, "ground.restitution": None})
    assert changed.ground.laws["magnet"] == Magnet(pull=4e-6)
    added = with_values(scene(), {"ground.laws.magnet": Magnet(pull=1.0)})
    assert added.ground.laws == {"magnet": Magnet(pull=1.0)}


def test_origin_is_that_of_the_nearest_table() -> None:
    printed = Provenance(source=Source.PRINTED, note="Table 1.")
    derived = Provenance(source=Source.DERIVED, note="From it.")
    it = scene(provenance={"robot.structure": printed, "robot.structure.mass.0": derived})
    assert it.origin("robot.structure.stiffness.0.1") == printed
    assert it.origin("robot.structure.mass.0.0") == derived
    assert it.origin("robot.structure.mass.1.1") == printed
    assert it.origin("duration") is None


def test_override_keeps_provenance_true() -> None:
    printed = Provenance(source=Source.PRINTED, note="Table 1.")
    it = scene(
        ground=Ground(film=Film(coefficient=1e-21, thickness=1e-6)),
        provenance={"ground.film": printed, "signals.pzt": printed, "robot.structure.mass": printed},
    )
    changed = override(it, {"ground.film": None, "signals.pzt.amplitude": "6 V", "robot.structure.mass.1.1": 2e-6})
    assert changed.provenance == {
        "signals.pzt": printed,
        "robot.structure.mass": printed,
        "signals.pzt.amplitude": Provenance(source=Source.ASSUMED, note="Set by the user; was 8 V (printed)."),
    }


def test_scenes_are_hashable_values() -> None:
    assert scene() == scene()
    assert hash(scene()) == hash(scene())
    assert hash(load_scene("cantilever")) == hash(load_scene("cantilever"))


def test_with_values_on_a_device_is_little_work() -> None:
    it = load_scene("cantilever")
    values = {
        "ground.film.coefficient": 1e-21,
        "robot.structure.damping_ratios.0": 0.03,
        "robot.drives.pzt.law.weights.2": -1e-7,
        "signals.pzt.amplitude": 7.0,
    }
    assert calls(lambda: with_values(it, values)) < 2000


def test_a_scene_is_printed_as_a_short_table():
    lines = str(load_scene("cantilever")).splitlines()
    assert lines[0].startswith("cantilever: beam, 1 foot on ") and max(map(len, lines)) < 120
    assert ["robot.feet.tip.gap", "70", "µm", "printed"] in [line.split() for line in lines]
    assert repr(load_scene("cantilever")) == "<Scene 'cantilever': beam with tip>"
