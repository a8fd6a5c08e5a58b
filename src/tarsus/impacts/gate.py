"""Whether a repeat may be used: its in-air record must explain it up to the first contact."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tarsus.impacts.alignment import Alignment

RESIDUAL_LIMIT = 0.10
"""Largest root mean square residual over signal before contact that passes, all channels together [1]."""

GAIN_LIMIT = 0.05
"""Largest deviation from one that the gain of a channel may have [1]."""


@dataclass(frozen=True)
class GateVerdict:
    """Whether a repeat passes, and why not in one sentence each."""

    accepted: bool
    reasons: tuple[str, ...]

    def __str__(self) -> str:
        return "The repeat is accepted." if self.accepted else " ".join(self.reasons)


def residual_gate(
    alignment: Alignment, residual_limit: float = RESIDUAL_LIMIT, gain_limit: float = GAIN_LIMIT
) -> GateVerdict:
    """Judge a repeat by what the aligned in-air record leaves of it before the first contact.

    A gain off one means that drive, structure or instrument changed between the records: the subtraction (3.27) has no
    gain, so such a pair is refused rather than mended.
    """
    reasons = []
    if not alignment.overall <= residual_limit:
        worst = int(np.argmax(alignment.residual))
        reasons.append(
            f"The repeat is rejected: before contact {alignment.overall:.1%} of the signal is left after subtraction, "
            f"above the limit of {residual_limit:.0%}; the worst channel is '{alignment.names[worst]}' with "
            f"{alignment.residual[worst]:.1%}."
        )
    if alignment.other is not None:
        reasons.append(
            "The repeat is rejected: the in-air record fits nearly as well delayed by "
            f"{1e3 * alignment.other:.4g} ms as by {1e3 * alignment.delay:.4g} ms, a period of the drive apart "
            "perhaps; give a part that is not periodic, or a narrower search."
        )
    for name, gain in zip(alignment.names, alignment.gain, strict=True):
        if not abs(gain - 1.0) <= gain_limit:
            reasons.append(
                f"The repeat is rejected: channel '{name}' has a gain of {gain:.3f} against the in-air record, more "
                f"than {gain_limit:.0%} off one."
            )
    return GateVerdict(not reasons, tuple(reasons))
