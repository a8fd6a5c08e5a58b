import numpy as np
import pytest

from effort import calls
from tarsus.base.errors import InputError
from tarsus.base.spec import with_values
from tarsus.files.library import load_scene
from tarsus.model.drive.laws import LinearForce
from tarsus.model.drive.waveforms import Sine
from tarsus.model.laws import Film, Restitution
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
from tarsus.model.structure import Lumped


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


def test_starting_below_the_ground() -> None:
    said = problems(lambda: scene(initial=Initial(displacement=["-71 um", "0 m"])))
    assert said[0].startswith("Scene.initial.displacement: foot 'toe' would start ")
    assert said[0].endswith(" below the ground")
    scene(initial=Initial(displacement=["-70 um", "0 m"]))
    upside_down = robot(feet={"toe": Foot(point="tip", gap="70 um", normal=-1)})
    scene(robot=upside_down, initial=Initial(displacement=["-71 um", "0 m"]))
    assert problems(lambda: scene(robot=upside_down, initial=Initial(displacement=["71 um", "0 m"])))


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
