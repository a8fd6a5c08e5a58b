"""`tarsus identify`: a device from a campaign, or which of its numbers moved over several."""

from __future__ import annotations

from typing import Any

from tarsus.cli import console
from tarsus.cli.asked import Asked

FILES = ("identified.toml", "identification.json", "draws.npz", "track.json", "track.csv", "report.html")
"""What is written of a campaign, and of a series."""


def identify(asked: Asked) -> int:
    """A campaign, or a series of them.

    Parameters
    ----------
    output
        Folder for what is found and its page; by default "identified" next to the campaign, of a series "tracked".
    """
    from tarsus.base.errors import InputError
    from tarsus.identify.result import write_identification
    from tarsus.identify.track import write_track

    campaign, track = asked.words["campaign"], asked.words["track"]
    if track is not None and not track:
        raise InputError("--track: name the campaigns that were recorded later, one or more, in their order")
    place = campaign if campaign.is_dir() else campaign.parent
    folder = asked.folder() or place / ("tracked" if track else "identified")
    asked.check(folder)
    with asked.calling() as function:
        found = function()
    with asked.writing(folder):
        written = [*(write_track if track else write_identification)(found, folder), *asked.paged(found, folder)]
    if not track:
        _complain(found)
    console.show(found, asked.flag("json"), written)
    return 1 if (found.alarms if track else found.not_done) else 0


def _complain(found: Any) -> None:
    """What was excluded, and steps that were not done by their reasons."""
    from tarsus.base.messages import together

    console.note(f"excluded: {one}" for one in together([str(one) for one in found.left_out]))
    undone = dict[str, list[str]]()
    for one in found.not_done:
        for said in one.reasons:
            undone.setdefault(said, []).append(one.name)
    console.complain(
        f"{' and '.join(those)} {'were' if len(those) > 1 else 'was'} not done: {said}"
        for said, those in undone.items()
    )
