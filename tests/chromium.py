"""A page in Chromium, without the network, for tests of what its scripts do. They are a lane: ``pytest -m browser``."""

from __future__ import annotations

import html
import json
import re
import shutil
import subprocess
from pathlib import Path
from typing import Any

NAMES = ("chromium", "chromium-browser", "google-chrome")


HOLD = """const held = document.body.appendChild(document.createElement("iframe"));
held.hidden = true;
held.contentDocument.open();
const ready = (found) => { document.body.dataset.found = JSON.stringify(found); held.remove(); };
"""
"""Of a script that waits for workers: the page counts as loading, on the clock of the world, until ``ready(found)``."""


def found_in(page: Path, *options: str, time: int | None = 5000) -> Any:
    """What a page's scripts left in ``document.body.dataset.found`` as JSON after ``time`` ms of its own
    clock, or, without, when it is loaded (see `HOLD`).

    The browser's profile lies beside the page. A machine without Chromium fails here.
    """
    browser = next(filter(None, map(shutil.which, NAMES)), None)
    assert browser, f"this lane needs Chromium on the path, as one of {', '.join(NAMES)}"
    done = subprocess.run(
        [
            browser, "--headless", "--no-sandbox", "--disable-gpu", "--host-resolver-rules=MAP * ~NOTFOUND",
            *([] if time is None else [f"--virtual-time-budget={time}"]), "--dump-dom",
            f"--user-data-dir={page.with_name('profile')}",
            *options, page.as_uri(),
        ],
        capture_output=True, text=True, timeout=180,
    )  # fmt: skip
    result = re.search(r'data-found="([^"]*)"', done.stdout)
    assert result, done.stderr[-2000:]
    return json.loads(html.unescape(result[1]))
