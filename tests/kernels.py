"""Which machine code OpenBLAS has chosen for this processor, and how to ask it for another.

numpy and scipy bring a library of their own each; ``OPENBLAS_CORETYPE``, read when they are loaded, chooses for both. A
processor that lacks the instructions falls back in silence or dies, so what is in use is asked of the libraries.

    OPENBLAS_CORETYPE=Prescott python tests/kernels.py

says what that gives here, and with ``--here`` the script names the kernels that this processor can run, with
``--others`` those of them that it does not run by itself.
"""

from __future__ import annotations

import ctypes
import platform
import sys
from pathlib import Path

KERNELS = {"Haswell": {"avx2", "fma"}, "SkylakeX": {"avx512f", "avx512dq", "avx512bw", "avx512vl"}, "Prescott": {"pni"}}
"""Kernels that the tests ask for -> instructions a processor must have, as Linux names them."""
_ALSO_CALLED = {"Katmai": "Prescott"}  # wheels hold no Katmai: its name stands for the oldest that they hold
_SYMBOLS = [
    f"{lead}openblas_get_corename{end}" for lead in ("scipy_", "") for end in ("64_", "")
]  # in wheels, and in a system's library


def in_use() -> dict[str, str]:
    """Kernel of every OpenBLAS that numpy and scipy have loaded, by the library's file; none where there is another."""
    found = {}
    for path in _libraries():
        library = ctypes.CDLL(str(path))
        for symbol in _SYMBOLS:
            if hasattr(library, symbol):
                ask = getattr(library, symbol)
                ask.restype = ctypes.c_char_p
                name = ask().decode()
                found[path.name] = _ALSO_CALLED.get(name, name)
                break
    return found


def _libraries() -> list[Path]:
    import numpy
    import scipy.linalg

    maps = Path("/proc/self/maps")
    if maps.exists():
        lines = maps.read_text(encoding="utf-8").splitlines()
        return sorted({Path(line.split(maxsplit=5)[5]) for line in lines if "openblas" in line})
    homes = [Path(package.__file__).parent for package in (numpy, scipy)]
    places = [home / ".dylibs" for home in homes] + [home.with_name(home.name + ".libs") for home in homes]
    return sorted(path for place in places if place.exists() for path in place.glob("*openblas*"))


def missing(kernel: str) -> str:
    """What this processor lacks for a kernel, in words; empty where it lacks nothing, or where nobody says."""
    if platform.machine().lower() not in ("x86_64", "amd64"):
        return f"{kernel} is machine code for x86-64, this processor is {platform.machine()}"
    info = Path("/proc/cpuinfo")
    if not info.exists():
        return ""
    flags = next((line for line in info.read_text().splitlines() if line.startswith("flags")), "").split()
    lacking = sorted(KERNELS[kernel] - set(flags)) if flags else []
    return f"{kernel} needs {', '.join(lacking)}, which this processor has not" if lacking else ""


def line() -> str:
    """What is in use, in a line."""
    return "OpenBLAS: " + (", ".join(f"{name} in {file}" for file, name in in_use().items()) or "none")


if __name__ == "__main__":
    import numpy as np
    import scipy.linalg

    if sys.argv[1:] in (["--here"], ["--others"]):
        own = set(in_use().values())
        here = [kernel for kernel in KERNELS if own and not missing(kernel)]
        print(*(kernel for kernel in here if sys.argv[1] == "--here" or own != {kernel}), sep="\n")
        sys.exit(0)
    square = np.random.default_rng(0).normal(size=(64, 64))
    np.linalg.eig(square @ square)  # a kernel that the processor cannot run dies here
    scipy.linalg.schur(square)
    print(line())
