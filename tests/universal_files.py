"""Universal files (data sets 58, 58b) with every field of the format, written by its columns and read back by pyuff."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pyuff
from numpy.typing import NDArray

from record_case import Case, Held

STEP = 1 / 4096
N = np.arange(64)
TIP = 0.02 * np.cos(0.3 * N) + 1e-3 * np.sin(2.0 * N)
DRIVE = -5.0 * np.sin(0.3 * N)
NONE = "NONE"
TURNS = {4: "RX", 5: "RY", 6: "RZ"}


def _row(numbers: Sequence[float], widths: Sequence[int], digits: Sequence[int]) -> str:
    return "".join(f"{one:{w}.{d}E}" for one, w, d in zip(numbers, widths, digits, strict=False))


def _text(table: NDArray[Any], double: bool, uneven: bool) -> list[str]:
    """Lines of numbers by the eight cases of the format."""
    if not double:
        widths, digits = [13] * 6, [5] * 6
    elif not uneven:
        widths, digits = [20] * 4, [12] * 4
    elif table.shape[1] == 2:
        widths, digits = [13, 20] * 2, [5, 12] * 2
    else:
        widths, digits = [13, 20, 20], [5, 12, 12]
    flat = table.ravel()
    return [_row(flat[k : k + len(widths)], widths, digits) for k in range(0, len(flat), len(widths))]


def function58(
    values: NDArray[Any],
    node: int,
    direction: int,
    *,
    kind: int = 11,
    label: str = NONE,
    double: bool = False,
    uneven: bool = False,
    order: str = "",
    entity: str = NONE,
    start: float = 0.0,
    axis_label: str = "s",
    reference: tuple[int, int] | None = None,
) -> bytes:
    """One time response, or with a reference a frequency response; order: of the bytes of a binary one, "<" or ">"."""
    columns = [values.real, values.imag] if np.iscomplexobj(values) else [values]
    table = np.column_stack([start + STEP * N, *columns] if uneven else columns)
    head = [one.ljust(80) for one in ("a response", NONE, "01-Jan-26 10:00:00", NONE, NONE)]
    at = reference or (0, 0)
    function = 4 if reference else 1
    response = f" {entity:10s}{node:10d}{direction:4d}"
    head.append(f"{function:5d}{0:10d}{0:5d}{0:10d}{response} {NONE:10s}{at[0]:10d}{at[1]:4d}")
    spacing = (0, 0.0, 0.0) if uneven else (1, start, STEP)
    code = 2 + 2 * double + (3 - double) * np.iscomplexobj(values)
    form = f"{code:10d}{len(values):10d}{spacing[0]:10d}"
    head.append(form + _row([*spacing[1:], 0.0], [13] * 3, [5] * 3))
    axis = f"{18:10d}{0:5d}{0:5d}{0:5d} {'Frequency':20s} {'Hz':20s}"
    head.append(axis if reference else f"{17:10d}{0:5d}{0:5d}{0:5d} {'Time':20s} {axis_label:20s}")
    head.append(f"{kind:10d}{0:5d}{0:5d}{0:5d} {NONE:20s} {label:20s}")
    head.append(f"{13 if reference else 0:10d}{0:5d}{0:5d}{0:5d} {NONE:20s} {'N' if reference else NONE:20s}")
    head.append(f"{0:10d}{0:5d}{0:5d}{0:5d} {NONE:20s} {NONE:20s}")
    if not order:
        lines = ["    -1", "    58".ljust(80), *head, *_text(table, double, uneven), "    -1"]
        return ("\n".join(lines) + "\n").encode("latin-1")
    numbers = table.astype(f"{order}f{8 if double else 4}").tobytes()
    first = f"    58b{1 if order == '<' else 2:6d}{2:6d}{11:12d}{len(numbers):12d}{0:6d}{0:6d}{0:12d}{0:12d}"
    return ("\n".join(["    -1", first, *head]) + "\n").encode("latin-1") + numbers + b"\n    -1\n"


def units164(code: int, length: float, force: float) -> bytes:
    """A system of units."""
    numbers = [f"{one:25.17E}".replace("E", "D") for one in (length, force, 1.0, 0.0)]
    lines = ["    -1", "   164", f"{code:10d}{'units':20s}{1:10d}", "".join(numbers[:3]), numbers[3], "    -1"]
    return ("\n".join(lines) + "\n").encode()


def _name(one: dict[str, Any]) -> str:
    """Degree of freedom of a set as pyuff reads it."""
    direction = int(one["rsp_dir"])
    axis = {0: "", 1: "X", 2: "Y", 3: "Z", **TURNS}[abs(direction)]
    entity = "" if one["rsp_ent_name"] in ("", NONE) else f"{one['rsp_ent_name']}:"
    sign = "" if direction == 0 else "+" if direction > 0 else "-"
    return f"{entity}{int(one['rsp_node'])}{sign}{axis}"


def _case(name: str, sets: Sequence[bytes], *told: tuple[str, float], start: float = 0.0, time: float = 1.0) -> Case:
    """A file of sets, with SI unit and factor of each response in it."""

    def write(path: Path) -> Held:
        path.write_bytes(b"".join(sets))
        read = pyuff.UFF(str(path)).read_sets()
        read = [one for one in (read if isinstance(read, list) else [read]) if one["type"] == 58]
        channels = {_name(one): (unit, factor * one["data"]) for one, (unit, factor) in zip(read, told, strict=True)}
        step = float((read[0]["x"][-1] - read[0]["x"][0]) / (len(read[0]["x"]) - 1)) * time
        return Held(channels, step, start)

    return Case(name, write)


def _forms() -> list[Case]:
    """Text and bytes of either order, single and double, even and uneven."""
    out = []
    for order, double, uneven in itertools.product(("", "<", ">"), (False, True), (False, True)):
        more: dict[str, Any] = {"double": double, "uneven": uneven, "order": order}
        sets = [function58(TIP, 1, 3, **more), function58(DRIVE, 2, 0, kind=0, label="V", **more)]
        words = {"": "text", "<": "bytes little", ">": "bytes big"}[order]
        name = f"{words}, {'double' if double else 'single'}, {'un' * uneven}even.uff"
        out.append(_case(name, sets, ("m/s", 1.0), ("V", 1.0)))
    return out


def _directions() -> list[Case]:
    """Translations and rotations along either sense of each axis."""
    out = []
    for direction in (1, -1, 2, -2, 3, -3, 4, -4, 5, -5, 6, -6):
        unit = "rad/s" if abs(direction) > 3 else "m/s"
        out.append(_case(f"direction {direction}.unv", [function58(TIP, 7, direction)], (unit, 1.0)))
    sets = [function58(TIP, 1, 1), function58(2 * TIP, 1, 3), function58(TIP, 1, -2, entity="wing")]
    return [*out, _case("three directions of a node.unv", sets, *[("m/s", 1.0)] * 3)]


def _label(kind: int, label: str, unit: str, factor: float) -> Case:
    name = f"label {label.replace('/', ' per ')} of {kind}.uff"
    return _case(name, [function58(TIP, 1, 3, kind=kind, label=label)], (unit, factor))


def _systems(*systems: tuple[str, int, float, float]) -> list[Case]:
    """Systems of units, whose numbers are divided by those of the data set 164."""
    return [
        _case(
            f"units {name}.uff",
            [units164(code, length, force), function58(TIP, 1, 3), function58(DRIVE, 2, 3, kind=13)],
            ("m/s", 1.0 / length),
            ("N", 1.0 / force),
        )
        for name, code, length, force in systems
    ]


def _long_lines() -> Callable[[Path], Held]:
    """Lines filled up to 80 characters and ended as on Windows, and an unknown data set before."""
    body = function58(TIP, 1, 3).decode().splitlines()
    other = ["    -1", "   151", *["a header"] * 7, "    -1"]

    def write(path: Path) -> Held:
        path.write_bytes(("\r\n".join(line.ljust(80) for line in [*other, *body]) + "\r\n").encode())
        read = pyuff.UFF(str(path)).read_sets(1)
        assert isinstance(read, dict)
        return Held({"1+Z": ("m/s", read["data"])}, float(read["abscissa_inc"]))

    return write


CASES = [
    *_forms(),
    *_directions(),
    _label(8, "µm", "m", 1e-6),
    _label(12, "g", "m/s^2", 9.80665),
    _label(12, "m/s²", "m/s^2", 1.0),
    _label(0, "mV", "V", 1e-3),
    _label(11, "in/s", "m/s", 0.0254),
    _label(13, "lbf", "N", 4.4482216152605),
    *_systems(
        ("SI", 1, 1.0, 1.0),
        ("MM", 5, 1000.0, 1000.0),
        ("CM", 6, 100.0, 100.0),
        ("IN", 7, 39.37007874015748, 0.2248089430997105),
        ("own", 9, 1000.0, 1.0),
    ),
    _case("starts late.uff", [function58(TIP, 1, 3, start=0.25, double=True)], ("m/s", 1.0), start=0.25),
    _case("axis in ms.uff", [function58(TIP, 1, 3, axis_label="ms")], ("m/s", 1.0), time=1e-3),
    Case("lines of 80, CRLF.uff", _long_lines()),
]
