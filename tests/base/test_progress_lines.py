"""Progress where stderr is no terminal."""

from __future__ import annotations

import re
import time

from tarsus.cli import console, lines


def test_long_work_says_how_it_goes_in_plain_lines(capsys, monkeypatch):
    monkeypatch.setattr(lines, "EVERY", 0.1)
    monkeypatch.setattr(lines, "SOON", 0.02)
    with console.progress_bar("runs", time_left=True) as progress:
        progress(40, 200, "")  # done before
        for done in (42, 44, 46):
            time.sleep(0.06)
            progress(done, 200, "two workers")
        time.sleep(0.3)  # nothing new, and a sign of life all the same
    said = capsys.readouterr().err
    assert "\r" not in said and "\x1b" not in said
    rows = said.splitlines()
    assert 2 <= len(rows) <= 6
    assert re.fullmatch(r"runs: 4[246] of 200 \(2[123] %\), two workers, 0 s, about \d+ s left", rows[0])
    assert rows[-1].startswith("runs: 46 of 200 (23 %)")


def test_a_tenth_of_the_work_is_a_line_before_its_time(capsys, monkeypatch):
    monkeypatch.setattr(lines, "SOON", 1e-9)
    with console.progress_bar("sets") as progress:
        for done in range(101):
            progress(done, 100, "")
    rows = capsys.readouterr().err.splitlines()
    assert [row.split(",")[0] for row in rows] == [f"sets: {n} of 100 ({n} %)" for n in range(10, 101, 10)]


def test_short_work_says_nothing(capsys):
    with console.progress_bar("gaits") as progress:
        for done in range(11):
            progress(done, 10, "")
    assert capsys.readouterr().err == ""


def test_the_longer_it_takes_the_fewer_lines(capsys, monkeypatch):
    now = [0.0]
    monkeypatch.setattr(lines.time, "monotonic", lambda: now[0])
    count = 0
    shown = lines.Lines("x", False)
    waits = iter(range(43200))  # a day, in the beats of two seconds

    def wait(_):
        now[0] += lines.SOON
        return next(waits, None) is None

    monkeypatch.setattr(shown._over, "wait", wait)
    shown._beat()
    count = len(capsys.readouterr().err.splitlines())
    assert 100 < count < 250
