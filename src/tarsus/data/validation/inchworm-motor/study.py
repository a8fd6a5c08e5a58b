"""An inchworm motor: the mean velocity of its shuttle over five cycles, for the volts and the frequency of a row."""

from tarsus.measure import point_speed
from tarsus.validation import RowCase

FIRST, LAST = 3, 8  # cycles between which the way is taken


def case(row, device):
    """Two square waves between 0 and the volts, half a period apart."""
    hertz, half = 1e3 * row["kHz"], 0.5 * row["volts"]
    changes: dict[str, object] = {"duration": LAST / hertz}
    for phase in ("first", "second"):
        changes |= {
            f"signals.{phase}.amplitude": half,
            f"signals.{phase}.offset": half,
            f"signals.{phase}.frequency": hertz,
        }
    return RowCase(changes, lambda run: {"velocity_m_s": point_speed(run, "shuttle", FIRST / hertz, LAST / hertz)})
