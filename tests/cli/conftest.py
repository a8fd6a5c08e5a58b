"""Running command lines: in this process, or as a user would."""

from __future__ import annotations

import json
import re
import tomllib
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest

PROGRESS = re.compile(r"[a-z, ]+: (\d+ of \d+|\d+ s)\b")
"""Lines that say how long work goes: on a slow machine, there are some."""


@dataclass(frozen=True)
class Result:
    """What one command line did."""

    code: int
    out: str
    err: str

    def json(self) -> Any:
        return json.loads(self.out)

    @property
    def sentences(self) -> list[str]:
        """Lines on stderr, every one of which must be a sentence of ours."""
        lines = [line for line in self.err.splitlines() if not PROGRESS.match(line)]
        assert all(line.startswith("tarsus: ") for line in lines), self.err
        return [line.removeprefix("tarsus: ") for line in lines]


@pytest.fixture(scope="session", autouse=True)
def compiled_engine() -> None:
    """Machine code on disk before the first command line, so that none of them speaks of compiling."""
    import tarsus

    tarsus.simulate(tarsus.load_scene("cantilever"), duration=0.001)


@pytest.fixture
def tarsus(capsys) -> Callable[..., Result]:
    """`tarsus("show", "cantilever")`: exit code, stdout and stderr of a command line run here."""
    from tarsus.cli import main

    def call(*words: str) -> Result:
        capsys.readouterr()
        code = main([str(word) for word in words])
        out, err = capsys.readouterr()
        assert "Traceback" not in err
        return Result(code, out, err)

    return call


@pytest.fixture
def opened(tarsus) -> Callable[..., Any]:
    """What `show` says of what a verb wrote, as plain data; `check` calls it a good one of its kind."""

    def call(path: Path, word: str, *shown: str) -> Any:
        text, found = tarsus("show", path), tarsus("show", path, "--json")
        assert (text.code, text.err, found.code) == (0, "", 0) and all(one in text.out for one in shown), text.out
        checked = tarsus("check", path)
        assert checked.code == 0 and f"is a good {word}: " in checked.out, checked.err
        return found.json()

    return call


@pytest.fixture(scope="session")
def simulated(tmp_path_factory) -> Path:
    """The folder of a run, to be copied before anything is changed."""
    from tarsus.cli import main

    folder = tmp_path_factory.mktemp("plot") / "run"
    assert main(["simulate", "cantilever", "--duration", "5 ms", "--no-report", "-q", "-o", str(folder)]) == 0
    return folder


@pytest.fixture
def scene_table(tmp_path) -> dict[str, Any]:
    """The packaged cantilever as the raw tables of its file, to be spoiled."""
    from tarsus.files.library import load_scene
    from tarsus.files.toml import write_scene

    file = tmp_path / "whole.toml"
    write_scene(load_scene("cantilever"), file)
    return tomllib.loads(file.read_text(encoding="utf-8"))


@pytest.fixture
def save(tmp_path) -> Callable[[dict[str, Any]], Path]:
    """Write raw tables as a scene file."""
    import tomlkit

    def write(table: dict[str, Any]) -> Path:
        file = tmp_path / "scene.toml"
        file.write_text(tomlkit.dumps(table), encoding="utf-8")
        return file

    return write


@pytest.fixture
def magnet() -> Path:
    """The example law file."""
    return Path(__file__).parents[2] / "examples" / "laws" / "magnet.py"
