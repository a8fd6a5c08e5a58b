"""A switch closed by a step of volts, and by a ramp so slow that it follows its equilibrium until there is none."""

from tarsus import Constant
from tarsus.measure import touchdown, volts_at
from tarsus.model.drive.waveforms import Ramp
from tarsus.validation import RowCase

TOP, SLOW = 100.0, 2.0  # end of the ramp [V], and its length [s]: 42,000 cycles of the beam


def case(row, device):
    """A step to the volts of the row, or the ramp."""
    if row["event"] == "ramp":
        ramp = Ramp(start=0.0, stop=TOP, duration=SLOW)
        changes = {"signals.gate": ramp, "duration": SLOW}
        return RowCase(changes, lambda run: {"pull_in_V": volts_at(run, "gate", touchdown(run, "beam"))})
    changes = {"signals.gate": Constant(level=row["volts"]), "duration": 100e-6}
    return RowCase(changes, closing)


def closing(run):
    """Moment and speed of the first touchdown."""
    first = run.events[:1]
    if not len(first):
        return {}
    return {"closing_us": touchdown(run, "beam"), "speed_m_s": float(first["speed_before"][0])}
