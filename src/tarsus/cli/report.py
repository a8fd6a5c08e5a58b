"""`tarsus report`: the page of a folder that a verb wrote, opened in the browser."""

from __future__ import annotations

from tarsus.cli import console
from tarsus.cli.asked import Asked


def report(asked: Asked, *, browser: bool = True) -> int:
    """The page is opened.

    Parameters
    ----------
    browser
        Open the page; without it its path is printed only.
    """
    with asked.calling() as function:
        page = function()
    print(page) if not asked.flag("json") else console.print_json({"page": str(page)})
    if browser:
        import webbrowser

        if not webbrowser.open(page.resolve().as_uri()):
            console.complain([f"no browser could be started; open {page} yourself"])
    return 0
