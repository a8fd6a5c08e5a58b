r"""Landing rules: whether a foot that reaches the ground departs by restitution or is held.

With the approach speed ``v``, restitution gives the departing speed ``e v`` (2.12).  The *pull* is the net force [N] of
the structure along the ground normal on the foot stopped there, and ``f_a(0)`` the adhesion at first contact (2.14), 0
without adhesion.  Every rule only decides about the landing: a held foot leaves when its pull exceeds ``f_a(t - t_c)``.
"""

from __future__ import annotations

from typing import Literal

from tarsus.base.spec import Amount, quantity
from tarsus.model.laws.base import Law


class Landing(Law):
    """Base of the landing rules."""

    slot = "landing"
    slot_note = "whether a foot that lands departs or is held; absent: held unless the pull exceeds the adhesion"


class CaptureUnlessPulled(Landing):
    """A foot is held unless the pull exceeds ``f_a(0)``; then it departs with ``e v``.

    Without adhesion it always departs, until its flights are too low to be distinguished from rest.
    """

    title = "held unless the pull exceeds the adhesion"
    kind: Literal["capture_unless_pulled"] = "capture_unless_pulled"


class RestituteFirst(Landing):
    """A foot departs with ``e v``; one that would at `speed` or slower is held if the pull is at most ``f_a(0)``.

    The speed has no default: adhesion here is a force without a range and an impact takes no time, so that no work or
    impulse of adhesion, and no such speed, follows from the other parameters.  At 0 m/s only what accumulates is held.
    """

    hook = "excess"
    function_name = "excess"
    leading = ("departing",)
    title = "restitution first, held when slow"
    kind: Literal["restitute_first"] = "restitute_first"
    speed: Amount = quantity("m/s", "departing speed up to which a foot that lands may be held", ge=0)

    @staticmethod
    def excess(departing: float, speed: float) -> float:
        """How much faster [m/s] than `speed` a foot departs; one that is not may be held."""
        return departing - speed


class PullAsPrinted(Landing):
    r"""(2.13) as printed: a foot departs with ``e v`` if ``f_pull`` is positive and above ``f_a(0)``, else it is held.

    .. math:: f_{pull} = -\sum_{j \ne p} (K_{pj} x_j + C_{pj} \dot x_j) + K_{pp} x_p + C_{pp} \dot x_p + F_p

    in the displacements of named points, the foot's velocity being the one after the bounce, ``+e v``.  ``F_p`` are the
    drive's force on the foot and its weight, of which the source's tip has none: (2.13) is what the rest of the system
    does to the foot, and the ground's electrostatics is no part of it.
    The last two terms of the structure have the sign opposite to that of its force (erratum E1).
    """

    title = "(2.13) as printed"
    kind: Literal["pull_as_printed"] = "pull_as_printed"


AnyLanding = CaptureUnlessPulled | RestituteFirst | PullAsPrinted
"""A landing rule, by its ``kind``."""
