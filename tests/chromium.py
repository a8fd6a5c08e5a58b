"""Pages in one Chromium without the network, for tests of what scripts do: a lane, ``pytest -m browser``.

It is spoken to by its DevTools protocol over a pipe: <https://chromedevtools.github.io/devtools-protocol>.
"""

from __future__ import annotations

import json
import os
import select
import shutil
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

NAMES = ("chromium", "chromium-browser", "google-chrome")
READY = "const ready = (found) => { document.body.dataset.found = JSON.stringify(found); };\n"
"""Of a script whose findings `Chromium.found_in` returns: ``ready(found)``."""

LONGEST = 60.0
"""Seconds that an answer may take: a busy machine is no fault of a page."""
_WAIT = """const passed = (ms) => new Promise((done) => setTimeout(done, ms));
while (!document.body.dataset.found) await passed(10);
return JSON.parse(document.body.dataset.found);"""
_PLACED = """import os, sys, fcntl
ends = [fcntl.fcntl(int(end), fcntl.F_DUPFD, 10) for end in sys.argv[1:3]]
for place, end in enumerate(ends, 3):
    os.dup2(end, place)
os.execv(sys.argv[3], sys.argv[3:])"""
"""Puts the two ends of pipes where Chromium looks for them, 3 and 4, and becomes it."""


class Chromium:
    """The browser, with a profile of its own; `page` opens one page after the other in it. A context that ends it.

    A machine without Chromium fails here.
    """

    def __init__(self, profile: Path) -> None:
        browser = next(filter(None, map(shutil.which, NAMES)), None)
        assert browser, f"this lane needs Chromium on the path, as one of {', '.join(NAMES)}"
        (asked, self._asks), (self._answers, answers) = os.pipe(), os.pipe()
        self._process = subprocess.Popen(
            [
                sys.executable,
                "-ISc",
                _PLACED,
                str(asked),
                str(answers),
                browser,
                "--headless",
                "--no-sandbox",
                "--disable-gpu",
                "--remote-debugging-pipe",
                "--no-first-run",
                "--host-resolver-rules=MAP * ~NOTFOUND",
                f"--user-data-dir={profile}",
                "about:blank",
            ],
            pass_fds=(asked, answers),
            stderr=subprocess.DEVNULL,
        )
        os.close(asked)
        os.close(answers)
        self._rest = b""
        self._count = 0
        self._told: list[dict[str, Any]] = []

    def __enter__(self) -> Chromium:
        return self

    def __exit__(self, *_: object) -> None:
        os.close(self._asks)  # at the end of its pipe the browser ends
        self._process.wait(LONGEST)
        os.close(self._answers)

    @contextmanager
    def page(
        self, file: Path, *, width: int = 1400, height: int = 900, dark: bool = False, before: str = ""
    ) -> Iterator[Page]:
        """A page that is loaded, without traces of those before. before: a script that runs before its own."""
        own = self.ask("Target.createBrowserContext")["browserContextId"]
        target = self.ask("Target.createTarget", url="about:blank", browserContextId=own)["targetId"]
        session = self.ask("Target.attachToTarget", targetId=target, flatten=True)["sessionId"]
        page = Page(self, session)
        page.resize(width, height)
        page.darken(dark)
        page.ask("Emulation.setScrollbarsHidden", hidden=False)  # as where somebody looks
        if before:
            page.ask("Page.addScriptToEvaluateOnNewDocument", source=before)
        for domain in ("Page", "Runtime", "Log"):
            page.ask(f"{domain}.enable")
        page.ask("Page.navigate", url=file.resolve().as_uri())
        self.wait(session, "Page.loadEventFired")
        try:
            yield page
        finally:
            self.ask("Target.disposeBrowserContext", browserContextId=own)
            self._told.clear()

    def found_in(self, file: Path, **look: Any) -> Any:
        """What a page's own scripts have found once they are `READY`; its other faults are errors here."""
        with self.page(file, **look) as opened:
            found = opened.run(_WAIT)
            assert not opened.faults, opened.faults
            return found

    def ask(self, method: str, session: str = "", **params: Any) -> Any:
        """The answer to a command of the protocol."""
        self._count += 1
        about = {"sessionId": session} if session else {}
        asked = {"id": self._count, "method": method, "params": params, **about}
        text = json.dumps(asked).encode() + b"\0"
        while text:
            text = text[os.write(self._asks, text) :]
        while True:
            said = self._next()
            if said.get("id") == asked["id"]:
                assert "error" not in said, f"{method}: {said['error']}"
                return said["result"]
            self._told.append(said)

    def wait(self, session: str, method: str) -> None:
        """Until an event of a page has come."""
        while not any(one["method"] == method for one in self.told(session)):
            self._told.append(self._next())

    def told(self, session: str) -> list[dict[str, Any]]:
        """All events of a page so far."""
        return [one for one in self._told if one.get("sessionId") == session]

    def _next(self) -> dict[str, Any]:
        until = time.monotonic() + LONGEST
        while b"\0" not in self._rest:
            ready, _, _ = select.select([self._answers], [], [], max(until - time.monotonic(), 0.0))
            assert ready, f"Chromium did not answer within {LONGEST:g} s"
            part = os.read(self._answers, 1 << 20)
            assert part, "Chromium ended by itself"
            self._rest += part
        said, _, self._rest = self._rest.partition(b"\0")
        return json.loads(said)


class Page:
    """A page that is open."""

    def __init__(self, browser: Chromium, session: str) -> None:
        self._browser, self._session = browser, session

    def ask(self, method: str, **params: Any) -> Any:
        return self._browser.ask(method, self._session, **params)

    def run(self, script: str) -> Any:
        """What the body of an asynchronous function returns in the page, as JSON can say it."""
        done = self.ask(
            "Runtime.evaluate",
            expression=f"(async () => {{ {script}\n }})()",
            awaitPromise=True,
            returnByValue=True,
            userGesture=True,
        )
        assert "exceptionDetails" not in done, _exception(done["exceptionDetails"])
        return done["result"].get("value")

    @property
    def faults(self) -> list[str]:
        """Errors so far: those that no script caught, those on the console, and files that were asked for."""
        found = []
        for one in self._browser.told(self._session):
            method, params = one["method"], one["params"]
            if method == "Runtime.exceptionThrown":
                found.append(_exception(params["exceptionDetails"]))
            elif method == "Runtime.consoleAPICalled" and params["type"] in ("error", "assert"):
                found.append(f"console: {[part.get('value', part.get('description')) for part in params['args']]}")
            elif method == "Log.entryAdded" and params["entry"]["level"] == "error":
                found.append(f"log: {params['entry']['text']} {params['entry'].get('url', '')}")
        return found

    def resize(self, width: int, height: int = 900) -> None:
        self.ask("Emulation.setDeviceMetricsOverride", width=width, height=height, deviceScaleFactor=1, mobile=False)

    def darken(self, dark: bool) -> None:
        """What the system asks for; the page follows it at once."""
        scheme = {"name": "prefers-color-scheme", "value": "dark" if dark else "light"}
        self.ask("Emulation.setEmulatedMedia", features=[scheme])


def _exception(details: dict[str, Any]) -> str:
    return details.get("exception", {}).get("description") or details["text"]
