"""Ground and legs of a walker from records of its body, from numbers that are far off."""

from __future__ import annotations

import numpy as np
import pytest

import tarsus as ts
from tarsus.base.errors import InputError
from tarsus.base.quantities import Quantity
from tarsus.base.spec import get_value, with_values
from tarsus.fit.record_problem import Seen, SeenRecord
from tarsus.fit.verdict import Verdict
from tarsus.identify.walking import identify_walk
from tarsus.model.scene import Scene
from tarsus.solve.outputs import Output

GROUND = {
    "ground.restitution.coefficient": 0.5,
    "ground.friction.coefficient": 0.3,
    "ground.adhesion.initial": 5e-7,
    "ground.film.coefficient": 5e-24,
}
LEGS = [
    f"robot.structure.legs.{leg}.{name}"
    for leg in ("L1", "R1")
    for name in ("stiffness_v", "damping_v", "stiffness_l", "damping_l")
]
BODY = tuple(
    Seen(Output(quantity, at), noise)
    for quantity, noise in ((Quantity.DISPLACEMENT, 1e-7), (Quantity.VELOCITY, 5e-5))
    for at in ("surge", "heave")
)


def body_record(scene: Scene, seconds: float, rng: np.random.Generator) -> SeenRecord:
    """Surge and heave of the body at 20 kHz: displacements to 100 nm, velocities to 50 um/s."""
    times = np.arange(1, round(20e3 * seconds) + 1) / 20e3
    at = ts.simulate(scene, seconds).states(times)
    values = np.concatenate([at.x[:2], at.v[:2]])
    noise = np.array([one.noise for one in BODY])
    return SeenRecord(BODY, times, values + noise[:, None] * rng.standard_normal(values.shape))


@pytest.mark.slow
def test_the_ground_is_found_while_the_robot_walks() -> None:
    rng = np.random.default_rng(0)
    nominal = ts.load_scene("millipede", hz=50, volts=14)
    truth = with_values(
        nominal, {p: float(get_value(nominal, p) * np.exp(0.1 * rng.standard_normal())) for p in LEGS}
    )
    spread = dict.fromkeys(GROUND, 1.0) | dict.fromkeys(LEGS, 0.1)
    record = body_record(truth, 0.1, rng)
    found = identify_walk(with_values(nominal, GROUND), record, spread, begin=3e-3, window=5e-3)
    assert found.left.max() < 1.3  # every window is followed to its noise
    true = np.array([float(get_value(truth, path)) for path in found.paths])
    sigma = np.log(found.values / true) / np.sqrt(np.diag(found.covariance))
    assert np.abs(sigma).max() < 3.5 and np.sqrt(np.mean(sigma**2)) < 1.6
    off = np.abs(found.values / true - 1.0)
    assert off[0] < 0.05 and off[1] < 0.05 and off[2] < 0.3
    assert found.verdict("ground.restitution.coefficient") is Verdict.DETERMINED


def test_a_record_without_a_window_is_refused() -> None:
    scene = ts.load_scene("millipede", hz=50, volts=14)
    record = SeenRecord(BODY[:1], np.array([1e-3]), np.zeros((1, 1)))
    with pytest.raises(InputError, match="less than a window"):
        identify_walk(scene, record, {"ground.restitution.coefficient": 1.0}, begin=0.0, window=5e-3)
