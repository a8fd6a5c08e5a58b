"""The hexapod's film is thin: seen from above it is anything, and the impacts tell it, and with it the
restitution."""

from __future__ import annotations

import numpy as np
import pytest

from laboratory import HEXAPOD
from tarsus.files.library import load_scene
from tarsus.identify.contact_film import film_by_impacts
from tarsus.identify.draws import DRAWS
from tarsus.identify.estimates import Estimates
from tarsus.identify.flight import FILM
from tarsus.identify.foot import FootModel
from tarsus.identify.restitution import PATH, identify_restitution
from tarsus.identify.step import StepResult
from tarsus.identify.traces import trace_of
from tarsus.model.drive.waveforms import Square
from tarsus.records.purpose import Purpose
from tarsus.synthesis.recordings import Instrument, Recording, recorded, rest_of

SEEN = 1.2059e-20, 2.0187e-5
"""Film [N m^2 s], [m] that records above the ground of one campaign told: 5.2 and 4.0 times too large."""
TIED, LOOSE = "ground.electrostatic.coefficient", "robot.drives.pzt.law.gain"


@pytest.fixture(scope="module")
def truth():
    scene = load_scene(HEXAPOD)
    return FootModel(scene, "foot1", "pzt", tuple(scene.robot.structure.points))


@pytest.fixture(scope="module")
def bounces(truth):
    """The two sets that a campaign of this device plans, one record each at 40 dB and 20 kHz."""
    waves = (Square(amplitude=5.0, frequency=117.463, offset=5.0), Square(amplitude=8.0, frequency=46.9852, offset=8.0))
    out = []
    for number, wave in enumerate(waves):
        take = Recording(f"bounces-{number + 1}", Purpose.BOUNCES, wave, 0.2)
        for record in recorded(truth.scene, take, Instrument(), "pzt", [10 * number + k for k in range(1)]):
            out.append(trace_of(record, truth.points, take.name, record.drive, rest_of(take)))
    return out


@pytest.fixture(scope="module")
def seen(truth):
    """What is known before the impacts: the film to a factor of three, a number that goes with it, and one that does
    not; and the step that found the film."""
    random = np.random.default_rng(3)
    logs = random.multivariate_normal([0.0, 0.0], [[1.2, 0.65], [0.65, 0.4]], DRAWS)
    step = StepResult("electrostatics", FILM, np.array(SEEN), np.array(SEEN) * np.exp(logs))
    tied = StepResult("tied", (TIED,), np.array([SEEN[0] ** 0.5]), step.samples[:, :1] ** 0.5)
    gain = truth.law.gain * (1.0 + 1e-5 * random.standard_normal((DRAWS, 1)))
    loose = StepResult("loose", (LOOSE,), np.array([truth.law.gain]), gain)
    return Estimates.nothing(truth).after(step).after(tied).after(loose), step


@pytest.fixture(scope="module")
def told(truth, bounces, seen):
    return film_by_impacts(*seen, bounces, (), (-truth.gap, 0.0))


def test_restitution_hangs_on_the_film_and_the_impacts_tell_both(truth, bounces, seen, told):
    true, level = truth.scene.ground.restitution.coefficient, (-truth.gap, 0.0)
    before, after = (
        identify_restitution(known.model(), known, bounces, level, seed=5)[0] for known in (seen[0], told[0])
    )
    assert abs(before.value(PATH) / true - 1.0) > 0.03
    assert after.value(PATH) == pytest.approx(true, rel=0.02)
    low, high = after.interval(PATH)
    assert low < true < high and high - low < 0.1 * true  # of four impacts, however they scatter


def test_the_film_is_told_as_an_impact_sees_it(truth, told):
    """By ``C / g0^2``, twice the integral of ``C / (g + g0)^3`` over the way up; by the four impacts whose approach is
    seen, and by none of the hops of micrometres a second that ten others are taken for."""
    film, step = truth.scene.ground.film, told[1]
    drawn = step.draws(FILM[0]) / step.draws(FILM[1]) ** 2
    low, high = np.quantile(drawn, [0.025, 0.975])
    assert low < film.coefficient / film.thickness**2 < high < 4.0 * low
    assert any(one.what == "impacts, for the film" and one.used == 4 for one in step.used)


def test_what_goes_with_the_film_moves_along(truth, told):
    found = dict(zip(told[0].paths, told[0].values, strict=True))
    assert found[TIED] == pytest.approx(found[FILM[0]] ** 0.5, rel=1e-6)
    assert found[LOOSE] == pytest.approx(truth.law.gain, rel=1e-5)


def test_without_impacts_nothing_changes(truth, seen):
    known, step = film_by_impacts(*seen, [], (), (-truth.gap, 0.0))
    assert known is seen[0] and np.array_equal(step.values, seen[1].values)
    assert "0 can be used, 3 are needed" in step.notes[-1]
