"""What a foot can be doing, and what takes it from one state to the next (Fig. 4.6, and what it leaves out)."""

from __future__ import annotations

AIR, STUCK, SLIPPING = 0, 1, 2
"""In the air; held on the ground and still along it; held on the ground and sliding."""

BEGIN_SLIP, BEGIN_STICK = 7, 8
"""Kinds of events beside those of `tarsus.core.arrays`: a held foot begins to slide, and stops sliding."""

NAMES = {AIR: "in the air", STUCK: "stuck", SLIPPING: "slipping"}

TRANSITIONS = (
    (AIR, AIR, "bounce", "reaches the ground and departs by the landing rule (pull > f_a(0) unless another is given): v+ = e v-"),
    (AIR, STUCK, "capture", "reaches the ground and is held; friction stops what it has along the ground"),
    (
        AIR,
        SLIPPING,
        "capture",
        "reaches the ground and is held, faster along it than the blow's friction stops",
    ),
    (STUCK, AIR, "release", "pull + smooth force > f_a(t - t_c)"),
    (SLIPPING, AIR, "release", "pull + smooth force > f_a(t - t_c)"),
    (STUCK, SLIPPING, "slip begins", "|F_t| > mu (N + f_a)"),
    (SLIPPING, STUCK, "stick begins", "sliding speed reaches 0 and |F_t| <= mu (N + f_a)"),
    (SLIPPING, SLIPPING, "turns round", "sliding speed reaches 0 and |F_t| > mu (N + f_a)"),
)
"""(from, to, event, condition) of every change of state that the engine makes; a foot that bounces below what a step can
hide is held as well (rest)."""
