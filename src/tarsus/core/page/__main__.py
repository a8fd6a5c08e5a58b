"""Compiles the engine for pages by hand: `python -m tarsus.core.page [OUT]`, next to its sources without OUT."""

import sys
from pathlib import Path

from tarsus.core.page.compiling import HERE, CannotCompile, build

if __name__ == "__main__":
    try:
        build(Path(sys.argv[1]) if sys.argv[1:] else HERE / "engine.wasm")
    except CannotCompile as error:
        raise SystemExit(str(error)) from None
