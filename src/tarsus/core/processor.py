"""Which engine runs here: wheels for x86-64 hold one for each level of it, in a folder of the level's name.

The highest that processor and operating system have is taken, or the one that ``TARSUS_PROCESSOR`` names. An engine
that was built on this machine, or for another kind of processor, is the only one and lies next to this file.
"""

from __future__ import annotations

import os
from collections.abc import Mapping
from pathlib import Path

from tarsus.base._linear import X86_64
from tarsus.base.errors import InputError

VARIABLE = "TARSUS_PROCESSOR"


def engines(core: Path, level: int = X86_64, environment: Mapping[str, str] = os.environ) -> list[str]:
    """The folder in ``core`` that holds the engine for a level of x86-64; none where there is only one engine.

    Raises `InputError` where the processor has no level there is an engine for, or not the one asked for.
    """
    built = {one.name: one for one in core.glob("x86-64-v?")}
    if not built:
        return []
    runs = [name for name in sorted(built) if int(name[-1]) <= level]
    wanted = environment.get(VARIABLE, runs[-1] if runs else "")
    if wanted in runs:
        return [str(built[wanted])]
    if not runs:
        raise InputError(f"the engine needs a processor of {min(built)} (from about 2009 on), and this one is older")
    raise InputError(f"{VARIABLE} is {wanted!r}: this processor runs {', '.join(runs)}")
