"""The packaged hexapod's film is thin: seen from above it is anything, and the impacts tell it, and with it the
restitution."""

from __future__ import annotations

import numpy as np
import pytest

from tarsus.experiment.synthesis import Instrument, Purpose, Take, recordings, rest_of
from tarsus.files.library import load_scene
from tarsus.identify.contact_film import film_by_impacts
from tarsus.identify.draws import DRAWS
from tarsus.identify.electrostatics import FILM
from tarsus.identify.foot import FootModel
from tarsus.identify.known import Known
from tarsus.identify.restitution import PATH, identify_restitution
from tarsus.identify.step import StepResult
from tarsus.identify.traces import trace_of
from tarsus.model.drive.waveforms import Square

SEEN = 1.2059e-20, 2.0187e-5
"""Film [N m^2 s], [m] that records above the ground of one campaign told: 5.2 and 4.0 times too large."""


@pytest.fixture(scope="module")
def truth():
    scene = load_scene("hexapod")
    return FootModel(scene, "foot1", "pzt", tuple(scene.robot.structure.points))


@pytest.fixture(scope="module")
def bounces(truth):
    """The two sets that a campaign of this device plans, three records each at 40 dB and 20 kHz."""
    waves = (
        Square(amplitude=5.0, frequency=117.463, offset=5.0),
        Square(amplitude=8.0, frequency=46.9852, offset=8.0),
    )
    out = []
    for number, wave in enumerate(waves):
        take = Take(f"bounces-{number + 1}", Purpose.BOUNCES, wave, 0.2)
        for record in recordings(truth.scene, take, Instrument(), "pzt", [10 * number + k for k in range(3)]):
            out.append(trace_of(record, truth.points, take.name, record.drive, rest_of(take)))
    return out


@pytest.fixture(scope="module")
def seen(truth):
    """What is known before the impacts: everything but the film, which is known to a factor of three."""
    random = np.random.default_rng(3)
    logs = random.multivariate_normal([0.0, 0.0], [[1.2, 0.65], [0.65, 0.4]], DRAWS)
    step = StepResult("electrostatics", FILM, np.array(SEEN), np.array(SEEN) * np.exp(logs))
    return Known.nothing(truth).after(step), step


def test_restitution_hangs_on_the_film_and_the_impacts_tell_both(truth, bounces, seen):
    true = truth.scene.ground.restitution.coefficient
    level = -truth.gap, 0.0
    known, step = seen
    before = identify_restitution(known.model(), known, bounces, level, seed=5).step
    assert abs(before.value(PATH) / true - 1.0) > 0.03
    known, step = film_by_impacts(known, step, bounces, (), level)
    after = identify_restitution(known.model(), known, bounces, level, seed=5).step
    assert after.value(PATH) == pytest.approx(true, rel=0.02)
    low, high = after.interval(PATH)
    assert low < true < high and high - low < 0.06 * true
    film = truth.scene.ground.film
    at_contact = (
        film.coefficient / film.thickness**2
    )  # what an impact sees: the integral of C / (g + g0)^3 over g
    drawn = step.draws(FILM[0]) / step.draws(FILM[1]) ** 2
    low, high = np.quantile(drawn, [0.025, 0.975])
    assert low < at_contact < high and high < 4.0 * low


def test_what_goes_with_the_film_moves_along(truth, bounces, seen):
    known, step = seen
    random = np.random.default_rng(4)
    tied = step.draws(FILM[0]) ** 0.5
    other = StepResult(
        "other", ("ground.electrostatic.coefficient",), np.array([SEEN[0] ** 0.5]), tied[:, None]
    )
    loose = StepResult("loose", ("robot.drives.pzt.law.gain",), np.array([1.5e-6]),
                       1.5e-6 + 1e-9 * random.standard_normal((DRAWS, 1)))  # fmt: skip
    moved, _ = film_by_impacts(known.after(other).after(loose), step, bounces, (), (-truth.gap, 0.0))
    assert moved.values[2] == pytest.approx(moved.values[0] ** 0.5, rel=1e-6)
    assert moved.values[3] == pytest.approx(1.5e-6, rel=1e-3)


def test_without_impacts_nothing_changes(truth, bounces, seen):
    known, step = seen
    quiet = [trace for trace in bounces[:1]]
    assert film_by_impacts(known, step, [], (), (-truth.gap, 0.0)) == (known, step)
    assert film_by_impacts(known, step, quiet, (), (1e-3, 0.0)) == (known, step)
