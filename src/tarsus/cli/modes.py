"""`tarsus modes`: natural frequencies, damping ratios and shapes from measured files, with intervals and a page."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

from cyclopts import Parameter

from tarsus.cli.options import FLAG, PAGES, Many, MaybeFolder, Pages, at_least


def modes(
    *files: Path,
    band: str | None = None,
    order: Annotated[int, at_least(2)] = 40,
    drive: str | None = None,
    segment: Annotated[str | None, Parameter(allow_leading_hyphen=True)] = None,
    decay: Annotated[bool, FLAG] = False,
    read: Many = None,
    against: Path | None = None,
    output: MaybeFolder = None,
    pages: Pages = PAGES,
) -> int:
    """Find modes in frequency responses, in records with a drive, or in free decays, and say which are determined.

    Parameters
    ----------
    files
        responses (UFF 58, columns and others) or time records; other points, drives and repeats are merged.
    band
        lowest and highest frequency, e.g. 100Hz:1500Hz; all that is excited when left out.
    order
        largest order of the models: two or three times the number of modes expected.
    drive
        channel that recorded the drive, where the files do not say it.
    segment
        length of a segment of records with a random drive, e.g. "2 s"; sixteen averages when left out.
    decay
        the records are free decays, without a drive.
    read
        what the files do not say: channel=unit, such as Ch1=m/s, or step, frequency_step, axis, axis_unit, input_unit,
        record with their values; may be repeated.
    against
        modes.json of an earlier set: its modes beside these, with the MAC of their shapes.
    output
        folder for modes.json, modes.csv, shapes.unv (UFF 55) and report.html; nothing is written when left out.
    """
    import tarsus
    from tarsus.base.errors import Fault, InputError
    from tarsus.cli import console, requests
    from tarsus.files.jsontext import read_json
    from tarsus.modes.writing import MODES_FILES, compared, summary_of, write_modes

    ends = _band(band)
    length = requests.quantities_of(segment=(segment, "s")).get("segment")
    earlier = None if against is None else read_json(against)
    target = None if output is None else pages.target(output, "modes", MODES_FILES)
    reading = _reading(requests.texts_of(read or (), "--read"))
    with console.spinner("identifying"):
        try:
            fit = tarsus.modes(
                *files, band=ends, order=order, drive=drive, segment=length, decay=decay, read=reading
            )
        except InputError as error:
            raise InputError(
                [one.cured(Fault.NO_UNIT, "give it with --read NAME=UNIT") for one in error.problems]
            ) from None
    written: list[Path] = []
    names = tuple(str(file) for file in files)
    if target is not None and output is not None:
        with target.writing():
            written = write_modes(fit, output, names)
            if pages.report:
                from tarsus.report.modes_page import modes_html
                from tarsus.report.pages import write_page

                written.append(write_page(modes_html(fit, names), output / "report.html"))
    beside = None if earlier is None else compared(fit, earlier)
    if pages.json:
        console.print_json(summary_of(fit, names) | ({} if beside is None else {"compared": beside.json()}))
        return 0
    console.table(fit.table(), *([] if beside is None else [beside]))
    console.wrote(written)
    return 0


def _band(text: str | None) -> tuple[float, float] | None:
    """Both ends of a band [Hz]."""
    from tarsus.base.errors import InputError
    from tarsus.base.units import parse_quantity

    if text is None:
        return None
    low, _, high = text.partition(":")
    try:
        ends = parse_quantity(low, "Hz"), parse_quantity(high, "Hz")
    except InputError:
        ends = None
    if ends is None or not 0.0 <= ends[0] < ends[1]:
        raise InputError(f"--band takes a lower and a higher frequency, such as 100Hz:1500Hz, got '{text}'")
    return ends


def _reading(words: dict[str, str]) -> dict[str, Any]:
    """Choices of a reader: units of channels, and what has a field of its own there."""
    fields = ("step", "frequency_step", "axis", "axis_unit", "input_unit", "record")
    channels = {name: unit for name, unit in words.items() if name not in fields}
    own: dict[str, Any] = {name: text for name, text in words.items() if name in fields}
    return own | ({"channels": channels} if channels else {})
