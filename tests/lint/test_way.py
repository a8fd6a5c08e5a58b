"""The way of a scene from `simulate` to the engine, as docs/architecture.md draws it: each stage is entered once."""

from __future__ import annotations

import sys
from collections import Counter
from collections.abc import Callable, Iterator
from functools import cached_property
from inspect import getattr_static
from pathlib import Path
from types import FrameType
from typing import Any

import pytest

import tarsus as ts
from scene_files import scene

PACKAGE = Path(ts.__file__).parent
PREPARED = [
    "solve/simulation.py",
    "files/library.py",
    "solve/run.py",
    "plan/lowering.py",
    "plan/rows.py",
    "solve/engine.py",
]
MODES = ["core/modes.py", "core/blocks.py"]


class Way:
    """The files of the package that a call enters: a file is entered when none of its functions is at work."""

    def __init__(self, call: Callable[[], Any]) -> None:
        self.files: set[str] = set()
        """All of which anything is called, or an attribute asked for."""
        self.entered: Counter[str] = Counter()
        """How often each is entered by a function, in the order of the first times; attributes of data are none."""
        self._at_work: Counter[str] = Counter()
        sys.setprofile(self._seen)
        try:
            self.found = call()
        finally:
            sys.setprofile(None)

    def _seen(self, frame: FrameType, event: str, _: Any) -> None:
        path = Path(frame.f_code.co_filename)
        if event not in ("call", "return") or not path.is_relative_to(PACKAGE):
            return
        file = path.relative_to(PACKAGE).as_posix()
        self.files.add(file)
        if event == "call" and not self._at_work[file] and not _is_attribute(frame):
            self.entered[file] += 1
        self._at_work[file] += 1 if event == "call" else -1

    def stages(self) -> Iterator[tuple[str, int]]:
        """Those beside descriptions, the mathematics they share and the store of what was made, and how often each is
        entered."""
        beside = ("model/", "base/", "solve/shared.py")
        return ((file, n) for file, n in self.entered.items() if not file.startswith(beside))


def _is_attribute(frame: FrameType) -> bool:
    """Whether a frame is that of a property, which is data that a function asks for."""
    of: Any = sys.modules[frame.f_globals["__name__"]]
    for name in frame.f_code.co_qualname.split("."):
        of = getattr_static(of, name, None)
    return isinstance(of, (property, cached_property))


# Files in all: those of the stages, the descriptions, and a file each of the laws, the waveform and the structure.
@pytest.mark.parametrize(("name", "most"), [("p1_n6", 26), ("cantilever", 28), ("millipede", 27)])
def test_a_scene_enters_each_stage_once(name: str, most: int) -> None:
    given = scene(name) if name == "p1_n6" else ts.load_scene(name)
    duration = 2e-3 if name == "p1_n6" else 5e-3
    ts.simulate(given, duration)  # what is made at first use is made
    way = Way(lambda: ts.simulate(given, duration))
    stages, met = dict(way.stages()), 0
    if name != "millipede":  # the engine asks for each contact mode that the run is the first to meet
        met = len(way.found.motion.engine.tables.modes)
        assert met >= 2
        assert [stages.pop(file) for file in MODES] == [1 + met, met]
    assert stages == dict.fromkeys(PREPARED, 1) and list(stages) == PREPARED
    assert len(way.files) <= most
