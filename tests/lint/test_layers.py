"""The rules of docs/architecture.md that a machine can check."""

from __future__ import annotations

import ast
import re
import subprocess
import sys
from collections import defaultdict
from functools import cache
from pathlib import Path

ROOT = Path(__file__).parents[2]
PACKAGE = ROOT / "src"
SOURCES = sorted(PACKAGE.rglob("*.py"))
NATIVE = PACKAGE / "tarsus" / "core" / "native"
FLOORS = [{"base"}, {"laws", "drives"}, {"march"}, {"measure", "modal", "legged"}, {"flights"}, {"packet"}]
"""Rooms of the engine from below; those of one floor do not know each other. Bindings (*.cpp) are doors, and may know
every room."""


def modules_after(statement: str) -> set[str]:
    """Names of all modules loaded by a fresh interpreter after a statement."""
    code = f"import sys\n{statement}\nprint('\\n'.join(sys.modules))"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True, cwd=ROOT)
    return set(done.stdout.split())


def test_every_floor_imports_only_floors_below(monkeypatch, capsys):
    from importlinter.cli import lint_imports

    monkeypatch.chdir(ROOT)
    code = lint_imports(config_filename=str(ROOT / "pyproject.toml"), no_cache=True)
    assert code == 0, capsys.readouterr().out


def test_import_tarsus_loads_hardly_anything_beside_itself():
    """What an editable installation or a site has loaded before does not count."""
    statement = "before = set(sys.modules)\nimport tarsus\nfor name in before: sys.modules.pop(name)"
    own = {name for name in modules_after(f"{statement}\nimport sys") if not name.startswith("tarsus")}
    assert len(own) < 12 and not own & {"typing", "importlib.abc", "re", "inspect"}


def test_a_verb_loads_no_other_verb():
    loaded = modules_after("from tarsus.cli import main\nmain(['devices'])")
    assert "tarsus.files.library" in loaded and not loaded & {"tarsus.study.bench", "tarsus.identify.verb"}


@cache
def texts() -> dict[str, str]:
    """Every source file by its path in the package."""
    return {str(path.relative_to(PACKAGE)): path.read_text(encoding="utf-8") for path in SOURCES}


def test_no_source_file_configures_anything_at_import():
    """No warnings filters, environment changes, seeds or registrations when a module is imported."""
    forbidden = {"filterwarnings", "simplefilter", "putenv", "seed", "set_num_threads", "use", "rcParams"}
    named = re.compile(rf"\b(?:{'|'.join(forbidden)})\b")
    for path in (name for name, text in texts().items() if named.search(text)):
        for node in ast.parse(texts()[path]).body:
            if isinstance(node, ast.Expr) and isinstance(node.value, ast.Call):
                called = node.value.func
                name = called.attr if isinstance(called, ast.Attribute) else getattr(called, "id", "")
                assert name not in forbidden, f"{path} calls {name}() when it is imported"


def test_the_engine_numbers_events_codes_and_states_as_python_does():
    from tarsus.base.events import EventKind, FootState
    from tarsus.core import arrays

    text = (NATIVE / "march" / "kinds.hpp").read_text(encoding="utf-8")
    enums = {name: re.sub(r"//.*", "", body) for name, body in re.findall(r"enum (\w+) \{(.*?)\}", text, re.DOTALL)}
    kinds = dict(re.findall(r"(\w+) = (\d+)", enums["EventKind"]))
    assert {name: int(number) for name, number in kinds.items()} == {one.name: one.value for one in EventKind}
    assert [one.strip() for one in enums["Contact"].split(",")] == [one.name for one in FootState]
    codes = [one.strip() for one in enums["Code"].split(",")][:-1]  # the last one never leaves the engine
    assert [getattr(arrays, name) for name in codes] == list(range(len(codes)))


def test_a_class_name_exists_once():
    """Private ones too, within functions and other classes as well, so that a name says what is meant wherever it
    stands."""
    found = defaultdict(list)
    for path, text in texts().items():
        for name in re.findall(r"^ *class (\w+)[(:\[]", text, re.MULTILINE):
            found[name].append(path)
    assert {name: files for name, files in found.items() if len(files) > 1} == {}


def test_headers_of_the_engine_know_rooms_below_only():
    """So that each room can be read without those above."""
    floor_of = {room: n for n, floor in enumerate(FLOORS) for room in floor}
    wrong = [
        f"{header.relative_to(NATIVE)} includes {room}"
        for header in NATIVE.glob("*/*.hpp")
        for room in re.findall(r'^#include "(\w+)/', header.read_text(encoding="utf-8"), re.MULTILINE)
        if room != header.parent.name and floor_of[room] >= floor_of[header.parent.name]
    ]
    assert wrong == []
    assert {path.parent.name for path in NATIVE.glob("*/*.[hc]pp")} == set(floor_of)
