"""LabVIEW measurement files with every option of the format, read back by lvm_read."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path

import lvm_read
import numpy as np

from record_case import Case, Held

STEP = 1 / 1024
N = np.arange(30)
DRIVE = np.round(5.0 * np.sin(0.3 * N), 6)
TIP = np.round(2.0 * np.cos(0.3 * N), 6)


def _segment(x_columns: str, mark: str, decimal: str, start: float, comments: bool, first: float = 1.0) -> list[str]:
    """Header and numbers of one segment; ``first`` scales its numbers."""
    wide = 2 if x_columns == "Multi" else 1
    gap = mark * wide

    def row(key: str, *cells: str) -> str:
        return mark.join((key, *cells)) if wide == 1 else key + mark + (mark + mark).join(cells)

    lines = [
        mark.join(["Channels", "2", *[""] * (2 * wide)]),
        row("Samples", "30", "30"),
        row("Date", "2026/01/01", "2026/01/01"),
        row("Y_Unit_Label", "Volts", "mm/s"),
        row("X_Dimension", "Time", "Time"),
        row("X0", *2 * [f"{start:.16E}"]),
        row("Delta_X", *2 * [f"{STEP:.6E}"]),
        "***End_of_Header***" + gap + gap,
    ]
    names = {
        "No": ["X_Value", "drive", "tip"],
        "One": ["X_Value", "drive", "tip"],
        "Multi": ["X_Value", "drive", "X_Value", "tip"],
    }[x_columns]
    lines.append(mark.join([*names, *["Comment"] * comments]))
    for i, (u, v) in enumerate(zip(DRIVE, TIP, strict=True)):
        time = f"{start + STEP * i:.15f}"
        numbers = f"{first * u:.6f}", f"{first * v:.6f}"
        times = {"No": ["", *numbers], "One": [time, *numbers], "Multi": [time, numbers[0], time, numbers[1]]}
        lines.append(mark.join(times[x_columns] + ["warm"] * (comments and i == 0)))
    return [line.replace(".", decimal) for line in lines]


def _file(
    x_columns: str = "No",
    mark: str = "\t",
    decimal: str = ".",
    start: float = 0.0,
    comments: bool = False,
    segments: Sequence[float] = (1.0,),
    take: int = 0,
    special: bool = False,
) -> Callable[[Path], Held]:
    """A file with some options; take: the segment that is read."""

    def write(path: Path) -> Held:
        lines = [
            "LabVIEW Measurement" + mark,
            mark.join(("Writer_Version", "2")),
            mark.join(("Reader_Version", "2")),
            mark.join(("Separator", "Tab" if mark == "\t" else "Comma")),
            mark.join(("Decimal_Separator", decimal)),
            mark.join(("Multi_Headings", "Yes" if len(segments) > 1 else "No")),
            mark.join(("X_Columns", x_columns)),
            mark.join(("Time_Pref", "Relative")),
            mark.join(("Date", "2026/01/01")),
            "***End_of_Header***" + mark,
        ]
        if special:
            lines += [mark, "***Start_Special***", "Kind" + mark + "Hit", "***End_Special***"]
        for first in segments:
            lines += ["" if mark == "," else mark, *_segment(x_columns, mark, decimal, start, comments, first)]
        path.write_text("\n".join(lines) + "\n", encoding="utf-8")
        found = lvm_read.read(str(path), read_from_pickle=False, dump_file=False)[take]
        columns = dict(zip(found["Channel names"], found["data"].T, strict=False))
        return Held({"drive": ("V", columns["drive"]), "tip": ("m/s", 1e-3 * columns["tip"])}, STEP, start)

    return write


CASES = [
    Case("no times.lvm", _file()),
    Case("one column of times.lvm", _file("One", start=0.5)),
    Case("times of every channel.lvm", _file("Multi")),
    Case("start in the header.lvm", _file(start=0.25)),
    Case("commas.lvm", _file("One", ",")),
    Case("decimal commas.lvm", _file("One", decimal=",")),
    Case("comments.lvm", _file(comments=True)),
    Case("first of two segments.lvm", _file("One", segments=(1.0, 2.0)), {"record": 1}),
    Case("second of two segments.lvm", _file("One", segments=(1.0, 2.0), take=1), {"record": 2}),
]
