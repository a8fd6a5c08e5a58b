"""`tarsus identify`: from a campaign of records to a device with intervals, and a report."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from cyclopts import Parameter

from tarsus.cli.options import PAGES, MaybeFolder, Pages, Seed

if TYPE_CHECKING:
    from tarsus.identify.campaign import Opened


def identify(
    campaign: Path,
    /,
    *,
    track: Annotated[list[Path] | None, Parameter(negative=(), consume_multiple=True)] = None,
    output: MaybeFolder = None,
    seed: Seed = 1,
    pages: Pages = PAGES,
) -> int:
    """Identify a device from a campaign of records: structure, drive, film, adhesion, restitution, with intervals.

    Parameters
    ----------
    campaign
        campaign.toml, or the folder it is in (see `tarsus synthesize` for one).
    track
        campaigns on the same device recorded later, in their order: which of its numbers moved.
    output
        folder for identified.toml, identification.json, draws.npz and report.html, of a series for track.json,
        track.csv and report.html; by default "identified", of a series "tracked", beside the (first) campaign file.
    """
    from tarsus.base.errors import InputError
    from tarsus.base.messages import together
    from tarsus.cli import console
    from tarsus.identify.campaign import read_campaign
    from tarsus.identify.chain import identify as run
    from tarsus.identify.result import RESULT_FILES, write_identification

    if track is not None and not track:
        raise InputError("--track: name the campaigns that were recorded later, one or more, in their order")
    opened = read_campaign(campaign)
    if track:
        return _track([opened, *(read_campaign(one) for one in track)], output, seed, pages)
    folder = output if output is not None else opened.folder / "identified"
    target = pages.target(folder, "identify", RESULT_FILES)
    with console.progress_bar("steps") as progress:
        found = run(opened, seed, progress)
    with target.writing():
        written = write_identification(found, folder)
        if pages.report:
            from tarsus.report.identify_page import identify_html
            from tarsus.report.pages import write_page

            written.append(write_page(identify_html(found), folder / "report.html"))
    console.note(f"excluded: {one}" for one in together([str(one) for one in found.left_out]))
    undone = dict[str, list[str]]()
    for one in found.not_done:
        for said in one.reasons:
            undone.setdefault(said, []).append(one.name)
    console.complain(
        [
            f"{' and '.join(those)} {'were' if len(those) > 1 else 'was'} not done: {said}"
            for said, those in undone.items()
        ]
    )
    console.show(found, pages.json, written)
    return 1 if found.not_done else 0


def _track(opened: list[Opened], output: Path | None, seed: int, pages: Pages) -> int:
    """A series of campaigns; 1 where a number moved."""
    from tarsus.cli import console
    from tarsus.identify.track import TRACK_FILES, track, write_track

    folder = output if output is not None else opened[0].folder / "tracked"
    target = pages.target(folder, "identify", TRACK_FILES)
    with console.progress_bar("steps") as progress:
        found = track(opened, seed, progress)
    with target.writing():
        written = write_track(found, folder)
        if pages.report:
            from tarsus.report.pages import write_page
            from tarsus.report.track_page import track_html

            written.append(write_page(track_html(found), folder / "report.html"))
    console.show(found, pages.json, written)
    return 1 if found.alarms else 0
