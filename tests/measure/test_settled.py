"""Whether a run's contacts repeat at its end."""

import numpy as np
import pytest

import tarsus as ts
from scene_files import scene
from tarsus.files.settled import _quiet, repetition, settled
from tarsus.solve.codes import EVENT_TYPE


def table(restitution, gamma, gap=0.0):
    return scene(
        "vibrating_table",
        {"ground.restitution.coefficient": restitution, "signals.table.amplitude": gamma, "robot.feet.ball.gap": gap},
    )


@pytest.mark.parametrize(
    ("made", "duration", "multiple"),
    [
        (lambda: ts.load_scene("cantilever"), 0.2, 1),
        (lambda: ts.load_scene("millipede"), 0.6, 1),
        (lambda: ts.load_scene("millipede"), 0.2, 0),
        (lambda: table(0.5, 1.54, 0.12), 300.0, 2),  # just beyond the flip at 1.5268
        (lambda: table(0.9, 3.0), 100.0, 0),  # in chaos
    ],
)
def test_a_run_that_repeats_has_settled(made, duration, multiple):
    run = ts.simulate(made(), duration)
    told = settled(run)
    assert told.multiple == multiple
    assert ("Not settled" in str(told)) == (multiple == 0) and str(told) in str(run)
    if multiple:  # it says since when: what is cut there has the same end
        assert 0 <= told.since < told.periods - 4
        longer = settled(ts.simulate(made(), duration * 1.25))
        assert (longer.multiple, longer.since) == (told.multiple, told.since)


def test_where_events_do_not_tell_the_run_says_so():
    short, still = ts.simulate("cantilever", 0.08), ts.simulate(ts.load_scene("cantilever", volts=0.5), 0.2)
    for run, periods, why in ((short, 4, "it lasts 4 drive periods"), (still, 10, "no contact begins or ends")):
        told = settled(run)
        assert told.multiple is None and told.periods == periods
        assert why in str(told) and str(told) in str(run)
    assert settled(ts.simulate(scene("ball"))) is None  # without a drive there is nothing to repeat


def test_three_periods_are_seen_twice_before_they_repeat():
    """Contacts at phases of their own in three periods, and then at three that come again: after five such there is
    one comparison short of six."""
    phase = np.concatenate([[0.11, 0.43, 0.27], np.tile([0.2, 0.3, 0.4], 4)])
    events = np.zeros(len(phase), EVENT_TYPE)
    events["time"] = np.arange(len(phase)) + phase
    found = [repetition(events[:count], 1.0, float(count)) for count in (10, 11, 12, 13)]
    assert [one.multiple for one in found] == [0, 0, 3, 3]
    assert _quiet(np.array([0.5, 1.95])) == pytest.approx(0.225)
