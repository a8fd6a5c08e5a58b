"""Scenes and structures: loads, starts, provenance, and the matrices of what is described."""

from __future__ import annotations

import math

import numpy as np
import pytest

from tarsus.base.errors import InputError
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
from tarsus.model.structure import Beam, Lumped, Modal


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


def beam(**changes: object) -> Beam:
    values = {
        "frequencies": ["623 Hz", "6424 Hz"],
        "damping_ratios": [0.02, 0.02],
        "length": "750 um",
        "tip_length": "150 um",
        "tip_width": "100 um",
        "tip_thickness": "10 um",
        "tip_density": "2330 kg/m^3",
    }
    return Beam(**{**values, **changes})


def test_modal_matrices() -> None:
    modal = Modal(
        frequencies=["0 Hz", "100 Hz", "2 kHz"],
        damping_ratios=[0.0, 1.5, 0.01],
        modal_masses=["1 mg", "2 mg", "3 mg"],
        shapes={"foot": [1.0, 0.5, -0.2]},
        modal_damping=["1 uN s/m", "0 N s/m", "0 N s/m"],
        upward=[1.0, 0.0, 0.0],
    )
    matrices = modal.matrices()
    omega = 2 * math.pi * np.array([0.0, 100.0, 2000.0])
    mass = np.array([1e-6, 2e-6, 3e-6])
    np.testing.assert_allclose(matrices.mass, np.diag(mass), rtol=1e-15)
    np.testing.assert_allclose(matrices.stiffness, np.diag(mass * omega**2), rtol=1e-15)
    np.testing.assert_allclose(matrices.damping, np.diag([1e-6, 2 * 1.5 * omega[1] * 2e-6, 0.02 * omega[2] * 3e-6]))
    np.testing.assert_array_equal(modal.row("foot"), [1.0, 0.5, -0.2])
    assert modal.points == ("foot",)
    np.testing.assert_array_equal(modal.vertical(), [1.0, 0.0, 0.0])
    with pytest.raises(KeyError):
        modal.row("hand")


def test_lumped_modal_damping_gives_the_ratios() -> None:
    mass = [[2.0, 0.3], [0.3, 1.0]]
    lumped = Lumped(coordinates=["a", "b"], mass=mass, stiffness=[[3.0, -1.0], [-1.0, 4.0]], damping_ratios=[0.02, 1.7])
    m, c, k = (getattr(lumped.matrices(), name) for name in ("mass", "damping", "stiffness"))
    state = np.block([[np.zeros((2, 2)), np.eye(2)], [-np.linalg.solve(m, k), -np.linalg.solve(m, c)]])
    values = np.linalg.eigvals(state)
    slow = values[np.abs(values.imag) > 1e-9][0]
    assert -slow.real / abs(slow) == pytest.approx(0.02, rel=1e-10)
    real = np.sort(values[np.abs(values.imag) <= 1e-9].real)
    assert len(real) == 2, "the second mode is overdamped"
    assert -real.sum() / (2 * math.sqrt(real[0] * real[1])) == pytest.approx(1.7, rel=1e-10)


def test_beam_of_the_source() -> None:
    it = beam()
    stiffness, mass_per_length = it.section()
    assert stiffness == pytest.approx(1.139e-12, rel=1e-3)
    assert mass_per_length == pytest.approx(3.52e-7, rel=1e-3)
    assert it.static_compliance() == pytest.approx(164.0, rel=2e-3)
    assert it.tip.mass == pytest.approx(3.495e-10, rel=1e-12)
    np.testing.assert_allclose(it.modes().omega / (2 * math.pi), [623.0, 6424.0], rtol=1e-12)
    matrices = it.matrices()
    omega = np.sqrt(np.diag(matrices.stiffness) / np.diag(matrices.mass))
    np.testing.assert_allclose(np.diag(matrices.damping), 0.04 * omega * np.diag(matrices.mass), rtol=1e-14)


def test_beam_keeps_as_many_modes_as_damping_ratios() -> None:
    assert beam(damping_ratios=[0.01] * 5).matrices().mass.shape == (5, 5)


def test_a_scene_is_printed_as_a_short_table():
    lines = str(load_scene("cantilever")).splitlines()
    assert lines[0].startswith("cantilever: beam, 1 foot on ") and max(map(len, lines)) < 120
    assert ["robot.feet.tip.gap", "70", "µm", "printed"] in [line.split() for line in lines]
    assert repr(load_scene("cantilever")) == "<Scene 'cantilever': beam with tip>"
