"""`tarsus calibrate`: a device fitted to a table of measures; the calibration means nothing where a row has no run."""

from __future__ import annotations

from tarsus.cli import console
from tarsus.cli.asked import Asked


def calibrate(asked: Asked) -> int:
    """The page is written beside what the function writes."""
    from tarsus.report.calibrate_page import calibration_html
    from tarsus.report.pages import write_page

    folder = asked.folder()
    assert folder is not None
    with asked.writing(folder), asked.calling(output=folder) as function:
        result = function()
        numbers = result.to_dict()
        if asked.pages.report:
            write_page(calibration_html(numbers), folder / "report.html")
    console.show(result, asked.pages.json, [folder])
    lost = any(one["failed"] >= 1.0 for row in numbers["rows"] for one in row.get("training", {}).values())
    if lost:
        console.complain(["no run of some fitted rows reached its end; the calibration means nothing there"])
    return 1 if lost else 0
