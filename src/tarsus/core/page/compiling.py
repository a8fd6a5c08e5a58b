"""Compiles the engine for pages by zig's compiler, which comes as a wheel: `python -m tarsus.core.page [OUT]`.

The same sources as the module for Python: modal and legged systems. CMake runs this file too,
before anything of Tarsus is installed, so that it imports nothing of it.
"""

import hashlib
import os
import subprocess
import sys
import tempfile
from pathlib import Path

HERE = Path(__file__).resolve().parent
NATIVE = HERE.parent / "native"
SOURCES = (HERE / "engine.cpp", NATIVE / "modal" / "run.cpp", NATIVE / "legged" / "run.cpp")
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
SECTION = b"tarsus-sources"
"""Name of the custom section at the end of the module, which holds the digest of what it was compiled from."""


class CannotCompile(Exception):
    """Why there is no engine for pages: one sentence."""


def digest() -> str | None:
    """Digest of the sources and flags; None where the sources are not there, as in an installed wheel."""
    if not all(one.is_file() for one in SOURCES):
        return None
    found = hashlib.sha256(" ".join(FLAGS).encode())
    for file in (*SOURCES, HERE / "mutex", *sorted(NATIVE.rglob("*.hpp"))):
        found.update(file.read_bytes())
    return found.hexdigest()


def sources_of(module: bytes) -> str | None:
    """Digest of what a module was compiled from; None of one that does not say."""
    size = hashlib.sha256().digest_size * 2
    said = module[-size:]
    return said.decode("ascii") if module[:-size].endswith(SECTION) else None


def build(out: Path, *, quiet: bool = False) -> None:
    """Write the module to a file, whole or not at all; the first time takes a minute, for the C++ library.

    quiet: nothing is printed, and zig keeps nothing elsewhere, so that no other folder need be writable.
    Raises `CannotCompile`.
    """
    known = digest()
    if known is None:
        raise CannotCompile(
            "this installation has neither the engine for pages nor its sources; in the folder of the sources type "
            "`TARSUS_PAGE=1 pip install .`"
        )
    compiler = [sys.executable, "-P", "-m", "ziglang"]  # nothing of the folder where it is called
    if subprocess.run([*compiler, "version"], capture_output=True).returncode != 0:
        raise CannotCompile(
            "the engine for pages is compiled by zig's compiler: type `pip install ziglang`, then the same again"
        )
    with tempfile.TemporaryDirectory(prefix="tarsus-") as folder:
        fresh = Path(folder, "engine.wasm")
        env = {**os.environ, "ZIG_GLOBAL_CACHE_DIR": folder, "ZIG_LOCAL_CACHE_DIR": folder} if quiet else None
        command = [*compiler, "c++", *FLAGS, f"-I{HERE}", f"-I{NATIVE}", "-o", str(fresh), *map(str, SOURCES)]
        done = subprocess.run(command, env=env, capture_output=quiet, text=quiet)
        if done.returncode != 0:
            said = f": {done.stderr.strip().splitlines()[-1]}" if quiet and done.stderr.strip() else ""
            raise CannotCompile(f"zig could not compile the engine for pages{said}")
        content = bytes([len(SECTION)]) + SECTION + known.encode("ascii")
        module = fresh.read_bytes() + bytes([0, len(content)]) + content
    part = out.with_name(f"{out.name}.{os.getpid()}.new")  # renamed into its place: nobody reads half of it
    part.write_bytes(module)
    part.replace(out)


if __name__ == "__main__":
    build(Path(sys.argv[1]))
