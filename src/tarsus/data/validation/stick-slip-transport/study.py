"""A part on a pad of two constant accelerations: its mean velocity, simulated, and in closed form where it sticks."""

from tarsus.measure import point_speed
from tarsus.validation import RowCase

GRAVITY = 9.80665  # m/s^2
FIRST, LAST = 2, 7  # periods between which the way is taken


def case(row, device):
    """The two-phase wave of the row, as a square wave of the pad's acceleration."""
    slow, fast = GRAVITY * row["file_a_stick_g"], GRAVITY * row["a_slip_g"]
    period = 1.0 / row["hz"]
    changes = {
        "signals.pad.amplitude": 0.5 * (slow + fast),
        "signals.pad.offset": 0.5 * (slow - fast),
        "signals.pad.duty": fast / (slow + fast),
        "signals.pad.frequency": row["hz"],
        "robot.drives.squeeze.law.offset": -row["mean_force_N"],
        "duration": (LAST + 1) * period,
    }

    def read(run):
        speed = point_speed(run, "part", FIRST * period, LAST * period)
        return {"velocity_mm_s": speed, "closed_form": speed}

    friction = device.ground.friction.coefficient * row["mean_force_N"] / device.robot.structure.mass[1][1]
    return RowCase(changes, read, closed_form(period, slow, fast, friction))


def closed_form(period, slow, fast, friction):
    """Mean velocity of a part that sticks all through the slow phase, and slides in the fast one, by its friction per
    mass; no number for other parts."""
    brake = GRAVITY + friction
    if slow >= friction - GRAVITY or fast <= brake:
        return {}
    return {"closed_form": 0.5 * period * slow**2 * (fast - brake) / ((slow + fast) * (slow + brake))}
