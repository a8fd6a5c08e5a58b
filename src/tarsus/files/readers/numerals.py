"""Numbers in text files: encodings, decimal commas, and the step of the digits a number is written in."""

from __future__ import annotations

import codecs
import math
import re
from collections.abc import Sequence

from tarsus.errors import InputError

__all__ = ["column_of", "column_step", "digit_step", "number", "text_of"]

_DIGITS = re.compile(r"[+-]?\d*(?:\.(\d*))?(?:[eE]([+-]?\d+))?")
_GAPS = {"nan", "-nan", "+nan", "1.#qnan", "-1.#ind", "--", "n/a", "na", "null"}


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
    return float(plain.replace(",", ".") if comma else plain)


def digit_step(text: str, comma: bool = False) -> float:
    """Step of the last digit of a number: 0.01 for ``1.25``, 10 for ``1.2e2``; 0 if it is none."""
    match = _DIGITS.fullmatch(text.strip().replace(",", ".") if comma else text.strip())
    if match is None or not any(character.isdigit() for character in text):
        return 0.0
    return 10.0 ** (int(match[2] or 0) - len(match[1] or ""))


def column_step(rows: Sequence[Sequence[str]], column: int, comma: bool) -> float:
    """Coarsest step of the digits at the beginning and the end of a column; a zero with an exponent tells none."""
    cells = [row[column].strip() for row in (*rows[:3], *rows[-3:]) if column < len(row)]
    telling = [cell for cell in cells if not ("e" in cell.lower() and _number_or_zero(cell, comma) == 0.0)]
    return max((digit_step(cell, comma) for cell in telling), default=0.0)


def _number_or_zero(text: str, comma: bool) -> float:
    """Value of a number; 0 if it is none."""
    try:
        return number(text, comma)
    except ValueError:
        return 0.0


def column_of(
    rows: Sequence[Sequence[str]], column: int, name: str, first: int, source: str, comma: bool
) -> list[float]:
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
    out = []
    for i, cell in enumerate(cells):
        try:
            out.append(number(cell, comma) if cell else math.nan)
        except ValueError:
            raise InputError(
                f"{source}, line {first + i}: column '{name}' has '{cell}' where a number is expected"
            ) from None
    return out
