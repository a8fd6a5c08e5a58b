"""Build backend: scikit-build-core, and where the machine has no C++ compiler, the one that comes as a wheel."""

from __future__ import annotations

import os
import shutil
import stat
import sys
import tempfile
from pathlib import Path
from typing import Any

from scikit_build_core import build as _build
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

COMPILERS = ("c++", "g++", "clang++", "cl")


def _has_compiler() -> bool:
    return bool(os.environ.get("CXX")) or any(shutil.which(name) for name in COMPILERS)


def _with_compiler(requirements: list[str]) -> list[str]:
    return requirements if _has_compiler() else [*requirements, "ziglang"]


def _use_wheel() -> None:
    """Let CMake find zig's C++ compiler under the usual names, where there is no other."""
    if _has_compiler():
        return
    folder = Path(tempfile.mkdtemp(prefix="tarsus-compiler-"))
    for tool, variable in (("cc", "CC"), ("c++", "CXX"), ("ar", None), ("ranlib", None)):
        script = folder / f"zig-{tool}"
        script.write_text(f'#!/bin/sh\nexec "{sys.executable}" -m ziglang {tool} "$@"\n')
        script.chmod(script.stat().st_mode | stat.S_IEXEC)
        if variable:
            os.environ[variable] = str(script)
    given = os.environ.get("CMAKE_ARGS", "")
    os.environ["CMAKE_ARGS"] = f"{given} -DCMAKE_AR={folder}/zig-ar -DCMAKE_RANLIB={folder}/zig-ranlib"


def get_requires_for_build_wheel(config_settings: Any = None) -> list[str]:
    return _with_compiler(_build.get_requires_for_build_wheel(config_settings))


def get_requires_for_build_editable(config_settings: Any = None) -> list[str]:
    return _with_compiler(_build.get_requires_for_build_editable(config_settings))


def build_wheel(*arguments: Any, **named: Any) -> str:
    _use_wheel()
    return _build.build_wheel(*arguments, **named)


def build_editable(*arguments: Any, **named: Any) -> str:
    _use_wheel()
    return _build.build_editable(*arguments, **named)
