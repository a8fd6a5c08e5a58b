"""One mode that responses show, and whether they determine it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from enum import Enum

import numpy as np

from tarsus.base.arrays import Complexes, Floats
from tarsus.fit.ranges import Range
from tarsus.fit.verdict import WIDTH, determined
from tarsus.measure.mac import mac
from tarsus.modes.frf import Frf
from tarsus.modes.intervals import Basis, moved_by, pole_ranges, scatter_of, variances_of
from tarsus.modes.lsfd import stacked
from tarsus.modes.refine import LocalFit

TILTED = np.radians(45.0)
"""Angle from a real mode: halfway to an imaginary one."""
_FEWEST_TILTS = 4
"""Modes that can show a delay: any two tilts lie on a line through zero to within a turn."""
_LATEST = 0.5
"""Turns of the highest mode up to which a delay is sought: a longer one shifts neighbours against each other."""
_ALIKE = 0.9
"""MAC from which two shapes are one: the convention of test and model."""
_SHARED = 0.2
"""Part of the energy of two shapes that lies in the same files up to which they are of different ones: a tenth of each
elsewhere."""
_SHIFTED = 3.0
"""Half-power bands by which instruments that are moved about shift a mode at most; farther is another mode."""


class ModeVerdict(Enum):
    """Whether the responses determine a mode."""

    DETERMINED = "determined"
    UNDER_RESOLVED = "under-resolved"
    WRONG_WAY = "turns the wrong way"
    UNCERTAIN = "not determined"
    TURNED = "no real mode"
    DOUBLE = "second pole of a mode"


@dataclass(frozen=True)
class IdentifiedMode:
    """A mode that the responses show.

    frequency [Hz], undamped, and damping [1], the damping ratio, with their 95 % intervals; basis: between what their
    scatter was taken; residues (no, ni) of the displacement per unit of drive, times rad/s, for the pole above 0 Hz;
    tilt [rad]: angle between the residues, less the common delay, and those of a real mode, -pi/2 to pi/2;
    collinearity: 1 where all residues lie on one line through zero, 0 where they do not at all; orders: how many of
    the tried model orders have its pole; verdict, and reason: a sentence, empty for a determined mode; shifts (nr,):
    how far [rad/s] single repeats have the pole from here, None without repeats.
    """

    frequency: Range
    damping: Range
    basis: Basis
    residues: Complexes
    tilt: float
    collinearity: float
    orders: int
    verdict: ModeVerdict
    reason: str
    shifts: Complexes | None = None

    @property
    def pole(self) -> complex:
        """Pole [rad/s] above 0 Hz."""
        ratio = self.damping.value
        return 2.0 * np.pi * self.frequency.value * complex(-ratio, np.sqrt(1.0 - ratio**2))

    @property
    def band(self) -> float:
        """Width of its half-power band [Hz]."""
        return 2.0 * abs(self.damping.value) * self.frequency.value

    def with_verdict(self, frf: Frf) -> IdentifiedMode:
        """The same with what its numbers say of it alone."""
        verdict, reason = _judge(self, frf)
        return replace(
            self, verdict=verdict, reason=f"the mode at {self.frequency.value:.6g} Hz {reason}" * bool(reason)
        )


def mode_of(frf: Frf, fit: LocalFit, orders: int, spread: Floats | None = None) -> IdentifiedMode:
    """A mode from its local fit, with the standard deviations (2,) of frequency and damping between ways to fit."""
    off = None
    if frf.repeats is not None:
        apart = (frf.repeats - frf.values).reshape(len(frf.repeats), -1, len(frf.frequency))
        off = stacked(apart[..., fit.lines], 2) / fit.noise[:, None]
    scatter, basis = scatter_of(fit, off, frf.line)
    # scatter between channels or lines is that of the misfit itself, with its noise
    least = np.sqrt(variances_of(fit)) if basis is Basis.REPEATS else np.zeros(2)
    frequency, damping = pole_ranges(fit.pole, scatter, np.zeros(2) if spread is None else spread, least)
    shifts = None if off is None else np.dot(moved_by(fit.slopes, off), [1.0, 1.0j]).astype(np.complex128)
    residues = (fit.residues / fit.pole**frf.derivatives).reshape(frf.values.shape[:2])
    square, size = np.sum((1.0j * residues) ** 2), float(np.sum(np.abs(residues) ** 2))
    tilt, collinearity = float(np.angle(square)) / 2.0, float(np.abs(square)) / size
    return IdentifiedMode(
        frequency, damping, basis, residues, tilt, collinearity, orders, ModeVerdict.DETERMINED, "", shifts
    ).with_verdict(frf)


def _judge(mode: IdentifiedMode, frf: Frf) -> tuple[ModeVerdict, str]:
    damping, band, line = mode.damping, mode.band, frf.line
    if damping.value <= 0.0:
        return ModeVerdict.WRONG_WAY, (
            "turns the wrong way: its Nyquist curve runs anticlockwise, as with a damping ratio of "
            f"{damping.value:.2g}; look at the sign of the phase and at what else drives the structure"
        )
    if frf.forced and band < line:
        return ModeVerdict.UNDER_RESOLVED, (
            f"is under-resolved: its half-power band of {band:.2g} Hz is below the line spacing of {line:g} Hz; its "
            "frequency can be used, its damping cannot: measure longer"
        )
    if not determined(damping.low, damping.high) or damping.value >= 1.0:
        return ModeVerdict.UNCERTAIN, (
            f"has no certain damping: the 95 % interval of its ratio, {damping.low:.2g} to {damping.high:.2g}, reaches "
            f"farther than {100 * WIDTH:.0f} % to either side; average more"
        )
    if mode.frequency.half_width(1.0) > 0.5 * band:
        return ModeVerdict.UNCERTAIN, (
            f"has no certain frequency: its 95 % interval, {mode.frequency.low:.6g} to {mode.frequency.high:.6g} Hz, "
            "is wider than its half-power band; average more"
        )
    return ModeVerdict.DETERMINED, ""


def judged_together(modes: Sequence[IdentifiedMode], frf: Frf) -> tuple[tuple[IdentifiedMode, ...], float]:
    """Modes as the others make them look, and the delay [s] of the responses that all of them show.

    Residues that are tilted by more than 45 degrees, corrected for the delay, are of no real mode; of two poles whose
    half-power bands overlap and whose shapes are alike, and of two within three bands that are seen in the points of
    different files, the weaker is no mode of its own. Residues of free decays are turned as these began.
    """
    delay = delay_of(modes, frf) if frf.forced else 0.0
    out = []
    for mode in modes:
        tilt = mode.tilt + 2.0 * np.pi * mode.frequency.value * delay
        mode = replace(mode, tilt=float(np.angle(np.exp(2.0j * tilt))) / 2.0)
        if frf.forced and mode.verdict is ModeVerdict.DETERMINED and abs(mode.tilt) > TILTED:
            mode = replace(
                mode,
                verdict=ModeVerdict.TURNED,
                reason=(
                    f"the residues of the mode at {mode.frequency.value:.6g} Hz are turned by "
                    f"{np.degrees(mode.tilt):.0f} degrees from a real mode's: is the response a "
                    f"{frf.quantity.name.lower()}, is its delay taken out?"
                ),
            )
        out.append(mode)
    weaker = _doubles(out, frf)
    for k, other in weaker.items():
        if out[k].verdict is ModeVerdict.DETERMINED:
            out[k] = replace(
                out[k],
                verdict=ModeVerdict.DOUBLE,
                reason=(
                    f"the pole at {out[k].frequency.value:.6g} Hz is a second one of the mode at "
                    f"{out[other].frequency.value:.6g} Hz: the responses do not show two"
                ),
            )
    return tuple(out), delay


def delay_of(modes: Sequence[IdentifiedMode], frf: Frf) -> float:
    """Delay [s] of the responses by which the residues of the modes are tilted, 0 where they show none.

    Real modes have no tilt; a delay tilts each by its angle in that time. It is the one that brings the residues,
    weighted by the size of the resonances, nearest to real ones, and once more without those that stay beyond 45
    degrees. It is taken where it corrects more than chance would: tilts of real modes scatter by half of 45 degrees,
    and one number fitted takes chi-squared of one degree of freedom, below 6.63 in 99 of 100 cases.
    """
    known = [one for one in modes if 0.0 < one.damping.value < 1.0 and one.band > frf.line]
    if len(known) < _FEWEST_TILTS:
        return 0.0
    frequency = np.array([mode.frequency.value for mode in known])
    size = np.array([strength_of(mode, frf) for mode in known])
    tried = np.linspace(-_LATEST, _LATEST, 401) / frequency.max()
    left = np.array([mode.tilt for mode in known]) + 2.0 * np.pi * frequency * tried[:, None]
    squares = (np.angle(np.exp(2.0j * left)) / TILTED) ** 2
    cost = squares @ (size / size.mean())
    best = int(np.argmin(cost))
    if cost[len(tried) // 2] - cost[best] < 6.63:
        return 0.0
    real = squares[best] <= 4.0
    return float(tried[np.argmin(squares[:, real] @ size[real])])


def strength_of(mode: IdentifiedMode, frf: Frf) -> float:
    """Size of a mode's peak in its strongest response, in the responses' unit."""
    return float(np.max(np.abs(mode.residues)) / abs(mode.pole.real) * abs(mode.pole) ** frf.derivatives)


def _doubles(modes: Sequence[IdentifiedMode], frf: Frf) -> dict[int, int]:
    """Modes that are none of their own, with the stronger one that they belong to."""
    out: dict[int, int] = {}
    order = sorted(range(len(modes)), key=lambda k: -strength_of(modes[k], frf))
    for place, k in enumerate(order):
        for other in order[:place]:
            if other in out or modes[other].verdict is not ModeVerdict.DETERMINED:
                continue
            a, b = modes[k], modes[other]
            apart = abs(a.frequency.value - b.frequency.value) / (0.5 * (a.band + b.band))
            flat = a.residues.ravel(), b.residues.ravel()
            same = apart < 1.0 and float(mac(*flat)) > _ALIKE
            if same or (apart < _SHIFTED and _in_other_files(a, b, frf.files)):
                out[k] = other
    return out


def _in_other_files(a: IdentifiedMode, b: IdentifiedMode, files: Sequence[str]) -> bool:
    """Whether two modes are seen in the points of different files."""
    if len(set(files)) < 2:
        return False
    rows = np.array([[one == name for one in files] for name in sorted(set(files))], dtype=float)
    parts = [rows @ np.sum(np.abs(mode.residues) ** 2, axis=1) for mode in (a, b)]
    shared = np.minimum(*(part / part.sum() for part in parts))
    return float(shared.sum()) < _SHARED
