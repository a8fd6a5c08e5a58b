"""Scenes at the edges, drawn from seeds: a run ends in numbers, above the ground, and is not done with an open account.

`python tests/survey.py FILE` looks at ten thousand of them, and at how long each takes.
"""

from __future__ import annotations

import numpy as np
import pytest

import tarsus as ts
from random_scenes import plain_scene, scene_of, sliding_scene, wide_scene
from survey import faults, look_at
from tarsus.base.events import EventKind
from tarsus.solve.codes import ResultCode

FAST = (2, 3, 17, 22, 34, 38, 46, 59, 63, 75, 77, 225)
SLOW = [seed for seed in range(200) if seed not in FAST]


@pytest.mark.parametrize("seed", [*FAST, *(pytest.param(seed, marks=pytest.mark.slow) for seed in SLOW)])
def test_a_scene_nobody_chose_ends_well_or_says_what_failed(seed: int) -> None:
    try:
        found = look_at(scene_of(seed))
    except Exception as error:
        found = {"error": f"{type(error).__name__}: {error}"}
    assert [text for text in faults(found) if text != "slow"] == [], found


SLIDING = (5, 9, 24, 35, 453, 983, 3071)


@pytest.mark.parametrize("seed", [*SLIDING, *(pytest.param(s, marks=pytest.mark.slow) for s in range(100, 250))])
def test_feet_that_slide_do_so_too(seed: int) -> None:
    """Friction along ways that the structure couples with the normals as it will: no run stalls. Of the last three feet
    drive each other along: one moves against what pulls it, or stays at its very bound."""
    found = look_at(sliding_scene(seed))
    assert [text for text in faults(found) if text != "slow"] == [], found


def test_a_drive_that_rounding_cuts_into_a_sliver_is_followed_through_it() -> None:
    """A slewed output comes back to its command where a play turns: 2e-16 s of it lie between the two."""
    scene = plain_scene(30, legged=True)
    run = ts.simulate(scene)
    shortest = min(float((channel.start[1:] - channel.start[:-1]).min()) for channel in run.plan.channels)
    assert shortest < 1e-15
    assert run.ok
    assert len(run.events) == 8  # those of the second simulator


ONCE_WRONG = {
    # a strong film in which feet hardly move: its momentum per mass is 1e7 to 1e12 their speed and left few digits
    **dict.fromkeys((83, 150, 187, 160, 161, 223, 240, 313, 338), 2e-9),
    # one gap, or a film, a thousand times what the feet that land have: tolerances went by the largest length
    **dict.fromkeys((34, 75, 102, 217), 1e-9),
    # a stiff dashpot beside a loose chain: a slow block was 2e4 times its rates, its gap rounding; it stalled
    1340: 1e-10,
    # a film of one's own in which feet hardly move: rounding by its own size let steps shrink to their bound
    802: 2e-9,
    # two feet on one coordinate: with one held the other follows no leading foot, yet loads it
    151: 1e-8,
}
EVENTS = {1340: 3, 151: 22}


@pytest.mark.parametrize("seed", ONCE_WRONG)
def test_a_scene_that_went_wrong_once_keeps_its_account(seed: int) -> None:
    """Up to the closure beside it: what is left there is rounding."""
    found = look_at(scene_of(seed))
    assert found["code"] == "DONE" and found["closure"] < ONCE_WRONG[seed]
    assert found["events"] == EVENTS.get(seed, found["events"]) and found["steps"] < 200_000


@pytest.mark.parametrize("seed", [145, 335, 517, 307, 275])
def test_what_a_film_does_as_its_momentum_jumps_between_steps_is_in_the_account(seed: int) -> None:
    """Up to 1e-3 of the largest energy was missing: a step ends with the momentum of its polynomial, and the next
    begins with that of the gap; the more so the stronger the film is. 275 has a weak one, the others strong ones."""
    run = ts.simulate(wide_scene(seed))
    assert run.ok
    assert run.ledger.closure < 1e-9
    assert sum(work for law, work in run.ledger.laws.items() if law == "film") < 0.0


def test_a_run_under_a_strong_film_ends_with_the_velocities_that_its_last_step_shows() -> None:
    """They were 1e-4 m/s off, those of the momentum of a gap between two nodes. An implicit integration of the
    equations of motion (Radau, rtol 1e-7) ends with 1.9050841e-14 J."""
    run = ts.simulate(wide_scene(145))
    assert run.ledger.kinetic == pytest.approx(1.9050841e-14, rel=1e-6)
    np.testing.assert_allclose(run.at([run.end_time]).kinetic, run.ledger.kinetic, rtol=1e-9)


def test_a_hop_lower_than_the_error_of_a_step_is_followed_by_shorter_ones() -> None:
    """A pull that outgrows the attraction for 20 us lifts the foot by 1e-12 m. Steps that err by 1e-11 m see it pressed
    down as it is let go, and let go as it is pressed down, 2e-16 s later: several of these thirty runs stopped so."""
    base = ts.load_scene("hexapod")
    ratios = (0.0058273, 0.0143836, 0.0107725, 0.0082883, 0.0078266, 0.0120103)
    scene = ts.with_values(
        base,
        {
            "ground.electrostatic.coefficient": 5.434928e-17,
            "ground.film.coefficient": 5.434928e-20,
            "ground.restitution.coefficient": 0.427929,
            "robot.drives.pzt.law.gain": -1.4341913e-6,
            "robot.structure.damping_ratios": ratios,
            "signals.pzt": {"kind": "sine", "amplitude": 5.0, "offset": 5.0, "frequency": 134.0, "phase": 0.0},
        },
    )
    frequencies = 133.97417776 * (1.0 + 1e-4 * np.arange(-5, 25))
    coarse = ts.Accuracy(gap=1e-6, steps=40_000)
    batch = ts.simulate_batch(scene, {"signals.pzt.frequency": frequencies}, 0.3, accuracy=coarse)
    assert set(batch.codes) == {ResultCode.DONE}
    pressed = [int((batch.events(i)["kind"] == EventKind.CONTACT_AT_START).sum()) for i in range(len(batch))]
    assert 0 < max(pressed) < 20, "one or two shorter steps resolve such a hop"


@pytest.mark.parametrize("seed", [78, 1172])
def test_a_scene_in_which_nothing_moves_has_no_open_account(seed: int) -> None:
    """All its energies are below 1e-20 of its force times its length: rounding, compared with rounding."""
    run = ts.simulate(wide_scene(seed))
    ledger, (length, force, _) = run.ledger, run.motion.acting.rows.scales[0]
    assert run.ok and ledger.closure == 0.0
    assert max(abs(ledger.kinetic), abs(ledger.elastic), abs(ledger.residual)) < 1e-20 * force * length
