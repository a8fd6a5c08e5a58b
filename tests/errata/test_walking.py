"""E15 and E16: what makes the two grounds of Fig. 4.7 differ, and a damping that leaves no governing frequency."""

from __future__ import annotations

import numpy as np
import pytest

import tarsus as ts
from tarsus.model.structure.leg import SingleMode
from tarsus.model.structure.leg_motion import GRAVITY, step_response
from tarsus.model.structure.leg_step import step_lift
from tarsus_reproduce.claims import FilmUnit, examples
from tarsus_reproduce.legs import millipede_leg


def test_e15_attraction_lowers_the_amplitude_and_adhesion_makes_the_difference_of_figure_4_7():
    scene = ts.load_scene("millipede")
    grounds = examples(FilmUnit.NANO)
    electrostatics, adhesion = "ground.electrostatic.coefficient", "ground.adhesion.rate"

    def swing(ground) -> float:
        measures = ts.simulate(ts.with_values(scene, dict(ground))).measures
        return measures.vertical_amplitude.value

    first, second = (swing(grounds[name]) for name in "ab")
    assert first > 2.0 * second, "what Fig. 4.7 shows"
    weaker = swing({**grounds["a"], electrostatics: grounds["b"][electrostatics]})
    assert weaker > 1.5 * first, "with less attraction (a) would swing more, as Fig. 4.8 says"
    sticky = swing({**grounds["a"], adhesion: grounds["b"][adhesion]})
    assert first > 2.0 * sticky, "the adhesion of (b) alone stills it"


def test_e16_no_mass_that_the_leg_lifts_has_a_governing_frequency_with_the_damping_of_table_4_1():
    leg = millipede_leg().leg
    lift = step_lift(leg)
    heaviest = min(lift.lifted, lift.standing) / GRAVITY
    for mass, ratio in ((0.2e-6, 1.86), (heaviest, 0.55)):
        found = SingleMode.of(ts.with_values(leg, {"body_mass": mass}))
        assert found.damping_ratio == pytest.approx(ratio, abs=0.01)
    # a ratio of 0.55 overshoots once, by an eighth, and its second peak is below 2 % of the step: nothing rings
    assert np.exp(-np.pi * 0.55 / np.sqrt(1.0 - 0.55**2)) < 0.13
    motion = step_response(ts.with_values(leg, {"body_mass": 0.2e-6}), np.linspace(0.0, 0.02, 2001), gravity=0.0)
    assert motion.lift.max() <= motion.lift[-1] * (1.0 + 1e-3), "0.2 mg creeps up without a peak"
