"""Balls whose restitution is their second flight over the first: the flights that follow."""

from tarsus.measure import flight
from tarsus.validation import RowCase

GRAVITY = 9.80665  # of the device [m/s^2]


def case(row, device):
    """The restitution of the throw, and the height whose impact makes its first flight; both flights are thus input."""
    first, second = row["flight_1_s"], row["flight_2_s"]
    restitution = second / first
    speed = 0.5 * GRAVITY * first / restitution
    changes = {"ground.restitution.coefficient": restitution, "robot.feet.ball.gap": speed**2 / (2.0 * GRAVITY)}
    return RowCase(changes, lambda run: {f"flight_{n}_s": flight(run, "ball", n) for n in range(3, 9)})
