"""`tarsus report`: the page of a folder that a verb wrote, made again from what is stored."""

from __future__ import annotations

from pathlib import Path

from tarsus.cli.options import Json, LawFiles, Many


def report(
    folder: Path,
    /,
    *,
    law: LawFiles = None,
    draw: Many = None,
    browser: bool = True,
    json: Json = False,
) -> int:
    """Open the page of a folder in the browser; that of a run or sweep is made again from its files, nothing simulated.

    Parameters
    ----------
    folder
        what `simulate`, `sweep`, `identify`, `calibrate`, `design`, `branch`, `atlas` or `reproduce` wrote.
    draw
        over the map of an atlas: branch:8, what happens to the periodic motion along eight lines of it; a packaged
        study or study file, the lines along which it ran; a .csv with two columns of numbers, a curve; may be repeated.
    browser
        open the page; without it its path is printed only.
    """
    from tarsus.cli import console
    from tarsus.model.laws.userfile import laws_of
    from tarsus.report.verb import page_of

    with console.spinner("writing the report"):
        page, again = page_of(folder, laws_of(law or ()), draw or ())
    if json:
        console.print_json({"page": str(page), "made_again": again})
    else:
        print(page)
    if browser:
        import webbrowser

        if not webbrowser.open(page.resolve().as_uri()):
            console.complain([f"no browser could be started; open {page} yourself"])
    return 0
