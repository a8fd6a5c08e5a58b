"""Compiles the engine for pages by zig's compiler, which comes as a wheel: `python -m tarsus.core.page [OUT]`.

The same sources as the module for Python, modal and legged systems without their derivatives; CMake calls this file too.
"""

import subprocess
import sys
from pathlib import Path

HERE = Path(__file__).resolve().parent
NATIVE = HERE.parent / "native"
SOURCES = (HERE / "engine.cpp", NATIVE / "modal" / "run.cpp")
# As for the module for Python (CMakeLists.txt), but for a machine that throws nothing and has one thread.
FLAGS = [
    "--target=wasm32-wasi",
    "-mexec-model=reactor",
    "-std=c++17",
    "-O2",
    "-msimd128",
    "-fno-rtti",
    "-fno-math-errno",
]
FLAGS += ["-fno-trapping-math", "-ffp-contract=fast", "-Wno-psabi", "-Wl,-s", "-Wl,-z,stack-size=1048576"]


def build(out: Path) -> None:
    """Write the module to a file; the first time takes a minute, for the C++ library."""
    if missing := [one for one in SOURCES if not one.is_file()]:
        raise SystemExit(
            f"{missing[0]} is not there: the engine for pages is built from a checkout, or comes with a wheel"
        )
    compiler = [sys.executable, "-P", "-m", "ziglang"]
    if subprocess.run([*compiler, "version"], capture_output=True).returncode != 0:
        raise SystemExit("the engine for pages is built by zig's compiler: pip install ziglang")
    fresh = out.with_suffix(".new")  # renamed into its place, so that nobody reads half of it
    done = subprocess.run(
        [*compiler, "c++", *FLAGS, f"-I{HERE}", f"-I{NATIVE}", "-o", str(fresh), *map(str, SOURCES)]
    )
    if done.returncode != 0:
        raise SystemExit(done.returncode)
    fresh.chmod(0o644)
    fresh.replace(out)


if __name__ == "__main__":
    build(Path(sys.argv[1]) if sys.argv[1:] else HERE / "engine.wasm")
