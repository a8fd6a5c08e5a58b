"""A climber that stands still on a wall or below a ceiling while the volts of its pads fall: where it detaches."""

import math

from tarsus import Constant
from tarsus.base.events import EventKind
from tarsus.measure import volts_at
from tarsus.model.drive.waveforms import Ramp
from tarsus.validation import RowCase, named

INCLINES = {"inverted": math.pi, "wall": 0.5 * math.pi}
PADS = {"3": 3, "4": 4}
TIME = 4.0  # s in which the volts fall: 60 V/s, slow against the body on its legs (50 ms)
RAISED = "LH"  # the leg whose pad is off where three hold


def case(row, device):
    """Pads from the volts of the row down to 0, lift and swing at their bias, one pad off where three hold."""
    legs = list(device.robot.structure.legs)
    falling = Ramp(start=row["used_V"], stop=0.0, duration=TIME)
    changes: dict[str, object] = {"ground.incline": named(row, "pose", INCLINES), "duration": TIME}
    for leg in legs:
        changes[f"signals.{leg}_lift"] = Constant(level=100.0)
        changes[f"signals.{leg}_swing"] = Constant(level=100.0)
        changes[f"signals.{leg}_pad"] = falling
    if named(row, "pads", PADS) == 3:
        changes[f"signals.{RAISED}_pad"] = Constant(level=0.0)
    holding = next(leg for leg in legs if leg != RAISED)

    def read(run):
        """The first foot that detaches or slides, of those whose pads are on."""
        own = [run.foot_names.index(leg) for leg in legs if row["pads"] == 4.0 or leg != RAISED]
        ends = [
            one["time"]
            for one in run.events
            if one["foot"] in own and one["kind"] in (EventKind.RELEASE, EventKind.SLIP_BEGINS)
        ]
        return {"used_V": volts_at(run, f"{holding}_pad", min(ends, default=math.nan))}

    return RowCase(changes, read)
