"""Drive signals that could be recorded next."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import product

from pydantic import Field

from tarsus.base.errors import InputError
from tarsus.base.messages import nearest
from tarsus.base.spec import Amount, Description, MaybeAmount, quantity, with_values
from tarsus.base.units import format_quantity
from tarsus.model.drive.waveforms import RampedSquare, Waveform
from tarsus.model.scene import Scene


class Candidate(Description):
    """A drive signal that could be recorded.

    Raises
    ------
    InputError
        As any description; also if the record is shorter than two periods of the signal.
    """

    name: str = Field(min_length=1, description="what it is called in tables")
    signal: Waveform
    drive: str | None = Field(
        default=None, description="drive that it is for; absent: every drive with a signal"
    )
    gap: MaybeAmount = quantity(
        "m", "clearance of every foot at rest; the scene's own when absent", default=None, ge=0
    )
    record: Amount = quantity("s", "length of one record", gt=0)

    def on(self, scene: Scene) -> Scene:
        """The scene with this signal and gap.

        Raises
        ------
        InputError
            If the scene has no such drive, or no signal to replace.
        """
        drives = [self.drive] if self.drive is not None else list(scene.signals) or list(scene.robot.drives)
        if not drives:
            raise InputError(f"candidate '{self.name}': the scene has no drive for a signal")
        wrong = [d for d in drives if d not in scene.robot.drives]
        if wrong:
            hint = nearest(wrong[0], scene.robot.drives)
            raise InputError(f"candidate '{self.name}': the robot has no drive '{wrong[0]}'{hint}")
        values: dict[str, object] = {f"signals.{drive}": self.signal for drive in drives}
        if self.gap is not None:
            values |= {f"robot.feet.{foot}.gap": self.gap for foot in scene.robot.feet}
        return with_values(scene, values)


def candidate_grid(
    hz: Sequence[float],
    volts: Sequence[float],
    ramps: Sequence[float] = (0.0,),
    gaps: Sequence[float | None] = (None,),
    *,
    periods: int = 8,
) -> list[Candidate]:
    """Ramped squares of every combination, each recorded over some periods.

    Parameters
    ----------
    hz, volts
        Frequencies [Hz] and amplitudes [V].
    ramps
        Lambda, the share of half a period that each ramp takes (`RampedSquare.duty`): 0 a square, 1 a triangle.
    gaps
        Clearances [m]; None is the scene's own.
    periods
        Of one record, of which a third is dropped as transient.
    """
    out = []
    for f, v, ramp, gap in product(hz, volts, ramps, gaps):
        words = [format_quantity(float(f), "Hz"), format_quantity(float(v), "V"), f"lambda {ramp:g}"]
        words += [] if gap is None else [f"gap {format_quantity(gap, 'm')}"]
        signal = RampedSquare(amplitude=float(v), frequency=float(f), duty=float(ramp))
        out.append(Candidate(name=", ".join(words), signal=signal, gap=gap, record=periods / f))
    return out


def grid_about(
    scene: Scene,
    hz: Sequence[float] | None = None,
    volts: Sequence[float] | None = None,
    ramps: Sequence[float] | None = None,
    gaps: Sequence[float] | None = None,
    *,
    periods: int = 8,
) -> list[Candidate]:
    """Candidates about a scene's own signal, where nothing else is asked for.

    Frequencies are 0.1, 0.3, 1 and 2 times its own, amplitudes a quarter to all of it, lambda 0 and 0.25, the gap
    that of the scene: no signal is stronger than the one the device has.

    Raises
    ------
    InputError
        If the scene has no signal with an amplitude and a frequency, and these are not given; for values that a signal
        or a gap cannot have.
    """
    own = next(
        (s for s in scene.signals.values() if hasattr(s, "amplitude") and hasattr(s, "frequency")), None
    )
    missing = [name for name, given in (("frequencies", hz), ("amplitudes", volts)) if given is None]
    if own is None and missing:
        raise InputError(f"the scene has no periodic signal to go by: give {' and '.join(missing)}")
    return candidate_grid(
        _shares(own, "frequency", (0.1, 0.3, 1.0, 2.0)) if hz is None else hz,
        _shares(own, "amplitude", (0.25, 0.5, 0.75, 1.0)) if volts is None else volts,
        (0.0, 0.25) if ramps is None else ramps,
        (None,) if gaps is None else gaps,
        periods=periods,
    )


def _shares(signal: Waveform | None, name: str, shares: Sequence[float]) -> list[float]:
    """Shares of a value of a signal, to four digits."""
    return [float(f"{share * getattr(signal, name):.4g}") for share in shares]
