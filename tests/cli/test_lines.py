"""Lines of progress in a log."""

from __future__ import annotations

import re

from tarsus.cli import lines
from tarsus.cli.lines import Lines


def test_the_time_left_is_named_only_while_steps_are_left(monkeypatch, capsys):
    monkeypatch.setattr(lines, "SOON", 0.0)
    with Lines("design", time_left=True) as shown:
        for done in (0, 4, 9, 10):
            shown.say(done, 10, "runs")
    printed = capsys.readouterr().err.splitlines()
    said = {int(line.split(" of ")[0].split()[-1]): "left" in line for line in printed if " of " in line}
    assert {done: said[done] for done in (4, 9, 10)} == {4: True, 9: True, 10: False}
    assert re.fullmatch(r"design: 4 of 10 \(40 %\), runs, \d+ s, about \d+ s left", printed[0])
