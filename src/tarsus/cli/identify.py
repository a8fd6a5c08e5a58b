"""`tarsus identify`: from a campaign of records to a device with intervals, and a report."""

from __future__ import annotations

from pathlib import Path

from tarsus.cli.options import PAGES, MaybeFolder, Pages, Seed


def identify(
    campaign: Path,
    /,
    *,
    output: MaybeFolder = None,
    seed: Seed = 1,
    pages: Pages = PAGES,
) -> int:
    """Identify a device from a campaign of records: structure, drive, film, adhesion, restitution, with intervals.

    Parameters
    ----------
    campaign
        campaign.toml, or the folder it is in (see `tarsus synthesize` for one).
    output
        folder for identified.toml, identification.json, draws.npz and report.html; by default "identified" beside the
        campaign file.
    """
    from tarsus.cli import console
    from tarsus.identify.campaign import read_campaign
    from tarsus.identify.chain import identify as run
    from tarsus.identify.result import RESULT_FILES, summary_of, write_identification

    opened = read_campaign(campaign)
    folder = output if output is not None else opened.folder / "identified"
    target = pages.target(folder, "identify", RESULT_FILES)
    with console.progress_bar("steps") as progress:
        found = run(opened, seed, progress)
    with target.writing():
        written = write_identification(found, folder)
        if pages.report:
            from tarsus.report.identify_page import write_identify_report

            written.append(write_identify_report(found, folder / "report.html"))
    console.note(found.remarks)
    console.note(f"excluded: {one}" for one in found.left_out)
    console.complain([f"{one.name} was not done: {said}" for one in found.not_done for said in one.reasons])
    if pages.json:
        console.print_json(summary_of(found))
    else:
        print(f"{found.table().text()}\n\n{found.seconds:.0f} s")
        console.wrote(written)
    return 1 if found.not_done else 0
