"""Build backend: scikit-build-core, with two things of our own.

Where the machine has no C++ compiler that works, the one that comes as a wheel is used (``ziglang``); and an
editable installation is one line that puts ``src`` on the path, so that PYTHONPATH, new files and data files behave
as in any checkout. With TARSUS_PAGE=1 in the environment the engine for pages is compiled as well, by ``ziglang``.
"""

from __future__ import annotations

import base64
import hashlib
import json
import os
import shlex
import shutil
import subprocess
import sys
import tempfile
import zipfile
from functools import cache
from pathlib import Path
from typing import Any

from scikit_build_core import build as _build
from scikit_build_core import cmake as _cmake
from scikit_build_core.build import (
    build_sdist,
    get_requires_for_build_sdist,
    prepare_metadata_for_build_editable,
    prepare_metadata_for_build_wheel,
)

__all__ = [
    "build_editable",
    "build_sdist",
    "build_wheel",
    "get_requires_for_build_editable",
    "get_requires_for_build_sdist",
    "get_requires_for_build_wheel",
    "prepare_metadata_for_build_editable",
    "prepare_metadata_for_build_wheel",
]

ROOT = Path(__file__).resolve().parent.parent
COMPILERS = ("c++", "g++", "clang++")
ZIG = "ziglang>=0.13"
PROGRAM = """
#include <vector>
int main() { if constexpr (true) return int(std::vector<double>(1).size()) - 1; }
"""


def _compiles(compiler: str) -> bool:
    """Whether ``compiler`` makes a program of C++17: a name on the path may be a shell, or lack its headers."""
    with tempfile.TemporaryDirectory(prefix="tarsus-") as folder:
        source = Path(folder, "probe.cpp")
        source.write_text(PROGRAM)
        command = [compiler, "-std=c++17", str(source), "-o", str(Path(folder, "probe"))]
        try:
            return subprocess.run(command, capture_output=True, timeout=60, stdin=subprocess.DEVNULL).returncode == 0
        except (OSError, subprocess.TimeoutExpired):
            return False


@cache
def _compiler() -> str | None:
    """Path of a C++ compiler that works; None where there is none."""
    found = (shutil.which(name) for name in COMPILERS)
    return next((path for path in found if path and _compiles(path)), None)


def _left_to_cmake() -> bool:
    """The user's choice, or Windows, where CMake finds compilers that are not on the path."""
    return bool(os.environ.get("CXX")) or sys.platform == "win32"


def _with_compiler(requirements: list[str]) -> list[str]:
    """Zig's compiler where there is no other, and for the engine in pages, which wheels have (TARSUS_PAGE=1)."""
    has = _left_to_cmake() or _compiler()
    return requirements if has and os.environ.get("TARSUS_PAGE") != "1" else [*requirements, ZIG]


def _use_compiler() -> None:
    """Tell CMake which compiler: the one that was tried, or zig's under names that CMake takes for tools."""
    if _left_to_cmake():
        return
    if path := _compiler():
        os.environ["CXX"] = path
        return
    zig = _zig()
    folder = ROOT / "build" / "compiler"
    folder.mkdir(parents=True, exist_ok=True)
    tools = {}
    for tool in ("c++", "ar", "ranlib"):
        tools[tool] = script = folder / f"zig-{tool}"
        script.write_text(
            "#!/bin/sh\n"
            f'export ZIG_GLOBAL_CACHE_DIR="${{ZIG_GLOBAL_CACHE_DIR:-{folder / "cache"}}}"\n'
            f'exec {shlex.quote(str(zig))} {tool} "$@"\n'
        )
        script.chmod(0o755)
    os.environ["CXX"] = str(tools["c++"])
    given = os.environ.get("CMAKE_ARGS", "")
    chosen = shlex.join([f"-DCMAKE_AR={tools['ar']}", f"-DCMAKE_RANLIB={tools['ranlib']}"])
    os.environ["CMAKE_ARGS"] = f"{given} {chosen}".strip()


def _zig() -> Path:
    try:
        import ziglang

        zig = Path(ziglang.__file__).parent / "zig"
        subprocess.run([zig, "version"], check=True, capture_output=True)
    except (ImportError, OSError, subprocess.CalledProcessError) as error:
        raise SystemExit(
            f"Tarsus needs a C++17 compiler: none of {', '.join(COMPILERS)} on the path works, and neither does the "
            f"package ziglang ({error}); install g++ or clang++, or name a compiler in the variable CXX."
        ) from error
    return zig


def get_requires_for_build_wheel(config_settings: Any = None) -> list[str]:
    return _with_compiler(_build.get_requires_for_build_wheel(config_settings))


def get_requires_for_build_editable(config_settings: Any = None) -> list[str]:
    return _with_compiler(_build.get_requires_for_build_editable(config_settings))


def build_wheel(wheel_directory: str, config_settings: Any = None, metadata_directory: str | None = None) -> str:
    _use_compiler()
    return _build.build_wheel(wheel_directory, config_settings, metadata_directory)


def build_editable(wheel_directory: str, config_settings: Any = None, metadata_directory: str | None = None) -> str:
    """The module is put beside its sources by CMake; the wheel holds the metadata and one line that names ``src``."""
    _use_compiler()
    _keep_objects()
    name = _build.build_editable(wheel_directory, config_settings, metadata_directory)
    _name_sources(Path(wheel_directory, name))
    return name


def _keep_objects() -> None:
    """Let a further installation compile what has changed only.

    scikit-build-core clears its folder where its own place is another, as it is in every isolated environment. All
    that CMake takes from there is copied (nanobind) or told again each time (Python, ninja); a compiler other than that
    of the folder clears it as before.
    """
    for path in ROOT.glob("build/*/.skbuild-info.json"):
        try:
            known = json.loads(path.read_text())
            cached = path.with_name("CMakeCache.txt").read_text().splitlines()
            compiler = next(line for line in cached if line.startswith("CMAKE_CXX_COMPILER:"))
            if compiler.partition("=")[2] == os.environ["CXX"]:
                path.write_text(json.dumps({**known, "skbuild_path": str(_cmake.DIR)}, indent=2))
        except (OSError, ValueError, StopIteration, KeyError):
            continue  # nothing to keep


def _name_sources(wheel: Path) -> None:
    """Replace what scikit-build-core puts beside the metadata, a finder that goes before PYTHONPATH, by a path file."""
    with zipfile.ZipFile(wheel) as old:
        files = {name: old.read(name) for name in old.namelist() if ".dist-info/" in name and not name.endswith("/")}
    record = next(name for name in files if name.endswith(".dist-info/RECORD"))
    del files[record]
    files = {"tarsus.pth": f"{ROOT / 'src'}\n".encode(), **files}
    lines = []
    for name, content in files.items():
        digest = base64.urlsafe_b64encode(hashlib.sha256(content).digest()).rstrip(b"=").decode()
        lines.append(f"{name},sha256={digest},{len(content)}\n")
    files[record] = "".join([*lines, f"{record},,\n"]).encode()
    with zipfile.ZipFile(wheel, "w", zipfile.ZIP_DEFLATED) as new:
        for name, content in files.items():
            new.writestr(name, content)
