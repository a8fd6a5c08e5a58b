"""`tarsus recommend`: what to record next, by the draws that an identification left next to its device."""

from __future__ import annotations

from tarsus.cli.asked import Asked


def recommend(asked: Asked) -> int:
    """The draws next to the scene file are read."""
    from tarsus.synthesis.recommend import draws_next_to

    draws = asked.words["draws"] or draws_next_to(asked.words["device"])
    with asked.calling(draws=draws) as function:
        found = function()
    return asked.show(found, [])
