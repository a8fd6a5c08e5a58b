"""A run as one piece of bytes, from which the engine runs it without Python: what a page with the engine in it gets."""

from __future__ import annotations

import struct
from collections.abc import Iterator, Mapping
from itertools import product
from typing import Any

import numpy as np

from tarsus.base.errors import InputError
from tarsus.core import nodes
from tarsus.core.modes import ModeBook, unbiased_mode
from tarsus.model.drive.pieces import Channels
from tarsus.model.scene import Scene
from tarsus.plan.lowering import Plan, level_only
from tarsus.plan.rows import Rows
from tarsus.solve.engine import SINGLE_RUN, Accuracy, Engine, settings_arrays, step_lengths
from tarsus.solve.run import prepared
from tarsus.solve.shared import Shared

MAGIC, NAME = b"tarsus 1", 48
MOST_MODES = 256
"""A packet of so many contact modes is some 1 MB; a robot of nine feet has 512."""


def packed(arrays: Mapping[str, Any]) -> bytes:
    """Arrays by name as native/packet/packet.hpp reads them: whole numbers, or doubles."""
    out = [MAGIC, struct.pack("<q", len(arrays))]
    for name, value in arrays.items():
        array = np.asarray(value)
        whole = array.dtype.kind in "iub"
        array = array.astype("<i8" if whole else "<f8")
        assert len(name) < NAME, name
        out += [name.encode().ljust(NAME, b"\0"), struct.pack("<qq", int(whole), array.size), array.tobytes()]
    return b"".join(out)


def on_a_page(plan: Plan) -> None:
    """Refuse a robot that the engine of a page does not run, with one sentence."""
    level_only(plan, "the engine of a page runs")


def packet_arrays(scene: Scene, engine: Engine, rows: Rows, accuracy: Accuracy | None) -> dict[str, Any]:
    """What a packet holds of the first of some runs of an engine for a scene, by name.

    Raises InputError for more contact modes than a packet holds.
    """
    plan, duration = engine.plan, engine.duration
    on_a_page(plan)
    laws = plan.laws.arrays(plan.laws.terms, plan.laws.programs)
    parts = {
        "nodes": {name: value for name, value in vars(nodes).items() if name.isupper() and not name.startswith("_")},
        "signals": Channels.of(rows.pool).arrays,
        "laws": laws,
        "start": plan.start_arrays,
        "settings": settings_arrays(plan, duration, accuracy),
        "rows": _row(plan, rows),
    }
    if plan.legs is None:
        book = engine.tables
        assert isinstance(book, ModeBook)
        parts |= {"book": book.arrays} | dict(_modes(plan))
    else:
        mass, stiffness, damping = plan.legs.blocks.T
        lengths = step_lengths(duration)
        parts |= {"body": plan.legs.body._asdict()}
        parts |= {"legs": {"mass": mass, "stiffness": stiffness, "damping": damping, "lengths": lengths}}
    return {f"{head}.{name}": value for head, arrays in parts.items() for name, value in arrays.items()}


def _row(plan: Plan, rows: Rows) -> dict[str, Any]:
    names = ("parameters", "initial", "sources", "scales", "channels")
    return {name: getattr(rows, name)[0] for name in names} | {"idle": plan.idle}


def _modes(plan: Plan) -> Iterator[tuple[str, dict[str, Any]]]:
    """Every contact mode that a run may meet: each foot in the air, on the ground, or sticking there."""
    along = plan.system.tangents
    states = [(0, 1, 2) if along is not None and along[:, i].any() else (0, 1) for i in range(plan.feet)]
    if (count := int(np.prod([len(one) for one in states]))) > MOST_MODES:
        raise InputError(
            f"{plan.feet} feet make {count} contact modes: an explorer holds {MOST_MODES} of a robot that is no walker"
        )
    for chosen in product(*states):
        bits = [state > 0 for state in chosen]
        if along is not None:
            bits += [state == 2 for state in chosen]
        mask = sum(bit << i for i, bit in enumerate(bits))
        yield "mode." + "".join(str(int(bit)) for bit in bits), unbiased_mode(plan.system, mask).arrays


def packet_of(scene: Scene, seconds: float, accuracy: Accuracy | None = None) -> bytes:
    """The packet of a run of a scene, by default as exact as `tarsus.simulate` makes it.

    Raises InputError as `tarsus.simulate` does, and for more contact modes than a packet holds.
    """
    engine, rows = prepared(scene, {}, seconds, Shared())
    return packed(packet_arrays(scene, engine, rows, accuracy or SINGLE_RUN))
