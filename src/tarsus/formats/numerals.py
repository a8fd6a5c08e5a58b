"""Numbers in text files: encodings, decimal commas, and the step of the digits a number is written in."""

from __future__ import annotations

import codecs
import math
import re
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from tarsus.base.errors import InputError

_DIGITS = re.compile(r"[+-]?\d*(?:\.(\d*))?(?:[eE]([+-]?\d+))?")
_GAPS = {"nan", "-nan", "+nan", "1.#qnan", "-1.#ind", "--", "n/a", "na", "null"}
_THOUSANDS = {
    True: re.compile(r"[+-]?[1-9]\d{0,2}(?:\.\d{3})+(?:,\d*)?"),
    False: re.compile(r"[+-]?[1-9]\d{0,2}(?:,\d{3})+\.\d*"),
}
"""Numbers with marks of thousands, by whether the decimal sign is a comma."""
_FORTRAN = re.compile(r"[+-]?(?:\d+[.,]?\d*|[.,]\d+)[dD][+-]?\d+")
"""Numbers in double precision as Fortran writes them."""
_BEYOND = {"∞", "+∞", "-∞", "1.#inf", "-1.#inf"}
"""What PicoScope and older C libraries write where a converter was out of its range."""


def text_of(content: bytes) -> str:
    """Text of a file in UTF-8, UTF-16 with its mark, or else Latin-1, as instruments write it."""
    if content.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)):
        return content.decode("utf-16", errors="replace")
    try:
        return content.decode("utf-8-sig")
    except UnicodeDecodeError:
        return content.decode("latin-1")


def number(text: str, comma: bool = False) -> float:
    """Value of a number; nan for the words that stand for a gap; comma: whether it has a decimal comma.

    Raises
    ------
    ValueError
        If it is no number.
    """
    plain = text.strip()
    if plain.lower() in _GAPS:
        return math.nan
    if plain.lower() in _BEYOND:
        return -math.inf if plain.startswith("-") else math.inf
    if _FORTRAN.fullmatch(plain):
        plain = plain.replace("D", "e").replace("d", "e")
    if _THOUSANDS[comma].fullmatch(plain):
        plain = plain.replace("." if comma else ",", "")
    return float(plain.replace(",", ".") if comma else plain)


def digit_step(text: str, comma: bool = False) -> float:
    """Step of the last digit of a number: 0.01 for ``1.25``, 10 for ``1.2e2``; 0 if it is none."""
    match = _DIGITS.fullmatch(text.strip().replace(",", ".") if comma else text.strip())
    if match is None or not any(character.isdigit() for character in text):
        return 0.0
    return 10.0 ** (int(match[2] or 0) - len(match[1] or ""))


_ROUND = 4
"""Digits of a sampling rate that was set by hand: 800 Hz, 51.2 kHz, 1024 Hz."""


def rounding_of_step(step: float, digits: float) -> float:
    """Share by which a sampling step may be off: half of its last digit (``digits``), as 0.000977 stands for 1/1024.

    A step of one digit, of two that end in 5, and one whose rate has four digits at most, are taken for exact: they
    are what is set by hand.
    """
    count = step / digits if digits > 0.0 else 0.0
    by_hand = count < 9.5 or (count < 99.5 and round(count) % 5 == 0) or _is_round(1.0 / step)
    return 0.0 if by_hand else 0.5 * digits / step


def rounding_of_rate(rate: float, digits: float) -> float:
    """The same of a sampling rate; one of four digits at most is taken for exact."""
    return 0.0 if _is_round(rate) or _is_round(1.0 / rate) else 0.5 * digits / rate


def rounding_of_number(step: float) -> float:
    """The same of a step that a file holds as a number in double precision: 0.000977 was 1/1024 once."""
    return rounding_of_step(step, digit_step(repr(float(step))))


def _is_round(value: float) -> bool:
    return abs(float(f"{value:.{_ROUND}g}") / value - 1.0) < 1e-12  # rounding of a quotient and a decimal


def column_step(rows: Sequence[Sequence[str]], column: int, comma: bool) -> float:
    """Step of the digits at the beginning and the end of a column, the coarsest.

    Where numbers have as many decimals, or as many digits, it is that of each; else their zeros at the end were left
    out, and it is that of the most digits at the largest number. A zero that is written otherwise gives none.
    """
    cells = [row[column].strip() for row in (*rows[:3], *rows[-3:]) if column < len(row)]
    values = [_number_or_zero(cell, comma) for cell in cells]
    others = [(cell, value) for cell, value in zip(cells, values, strict=True) if value != 0.0]
    steps = [digit_step(cell, comma) for cell, _ in others]
    if not all(step > 0.0 for step in steps) or not steps:
        return max((digit_step(cell, comma) for cell in cells if "e" not in cell.lower()), default=0.0)
    orders = [math.floor(math.log10(abs(value))) for _, value in others]
    digits = [1 + order - round(math.log10(step)) for order, step in zip(orders, steps, strict=True)]
    if len(set(steps)) == 1 or len(set(digits)) == 1:
        return max(steps)
    return 10.0 ** (1 + max(orders) - max(digits))


def _number_or_zero(text: str, comma: bool) -> float:
    """Value of a number; 0 if it is none."""
    try:
        return number(text, comma)
    except ValueError:
        return 0.0


def check_ending(text: str, rows: Sequence[Sequence[str]], source: str) -> list[str]:
    """A note if the last line of a table does not end, so that its last number may be cut.

    Raises
    ------
    InputError
        If that number has fewer characters than the others of its column among these rows: it is cut.
    """
    if text.endswith("\n") or (text.endswith("\r") and "\r\n" not in text) or len(rows) < 2:
        return []
    if rows[-1][-1].strip().endswith(")"):  # of a complex number in brackets, which is whole
        return []
    column = len(rows[-1]) - 1
    others = [len(row[column].strip()) for row in rows[:-1] if column < len(row) and row[column].strip()]
    if others and len(rows[-1][column].strip()) < min(others):
        raise InputError(f"{source} is truncated: its last number '{rows[-1][column].strip()}' is cut")
    return [f"{source}: its last line has no line end; if the file is cut, its last number may be wrong"]


def column_of(
    rows: Sequence[Sequence[str]], column: int, name: str, first: int, source: str, comma: bool
) -> NDArray[np.float64]:
    """Numbers of a column until its last cell that is not empty; cells missing before that are gaps (nan).

    Parameters
    ----------
    rows
        Cells of the lines, the first of which is line ``first`` of the file.
    column, name
        Which column, and its name for errors.
    source
        Name of the file.
    comma
        Whether numbers have a decimal comma.

    Raises
    ------
    InputError
        For a cell that is no number, with its line.
    """
    cells = [row[column].strip() if column < len(row) else "" for row in rows]
    while cells and not cells[-1]:
        cells.pop()
    try:  # all at once, which is many times faster
        if comma and any("." in cell for cell in cells):
            raise ValueError("marks of thousands")
        return np.array([cell.replace(",", ".") for cell in cells] if comma else cells, dtype=str).astype(float)
    except ValueError:
        pass
    out = []
    for i, cell in enumerate(cells):
        try:
            out.append(number(cell, comma) if cell else math.nan)
        except ValueError:
            raise InputError(
                f"{source}, line {first + i}: column '{name}' has '{cell}' where a number is expected"
            ) from None
    return np.array(out)


def whole_table(lines: Sequence[str], separator: str | None, comma: bool) -> NDArray[np.float64] | None:
    """Numbers of lines that all have the same number of cells, shape (rows, columns); None if they are not that."""
    if any('"' in line for line in lines[:3]) or (comma and any("." in line for line in lines)):
        return None
    plain = [line.replace(",", ".") for line in lines] if comma else lines
    try:
        return np.loadtxt(plain, delimiter=separator, comments=None, ndmin=2)
    except ValueError:
        return None
