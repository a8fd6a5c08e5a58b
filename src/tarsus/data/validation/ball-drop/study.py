"""A ball whose restitution is that of its own first bounce: second height, flights and time to rest follow."""

import math

from tarsus.base.events import EventKind
from tarsus.measure import flight
from tarsus.validation import RowCase

DROP, INCH = 0.9144, 0.0254  # height of the drop, and an inch [m]


def case(row, device):
    """The restitution by the first height of the drop."""
    changes = {"ground.restitution.coefficient": math.sqrt(row["height_1_in"] * INCH / DROP)}
    return RowCase(changes, read)


def read(run):
    """The second flight has the second height, which the third touchdown knows."""
    impacts = run.events
    rest = impacts["time"][impacts["kind"] == EventKind.REST]
    return {
        "first_flight_s": flight(run, "ball", 1),
        "second_flight_s": flight(run, "ball", 2),
        "height_2_in": float(impacts["apex"][2]),
        "total_time_s": float(rest[0]) if len(rest) else math.nan,
    }
