"""Attributes that change what numbers mean, by the conventions of NetCDF: packing, gaps, ranges that are valid."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np

_LIKE_PACKING = (
    "scale",
    "offset",
    "gain",
    "slope",
    "intercept",
    "multiplier",
    "sensitivity",
    "conversion_factor",
    "calibration_factor",
    "scaling_factor",
)
"""Attributes that may say what numbers have to be multiplied by, in no convention."""
_PACKING = {"scale_factor", "add_offset", "_FillValue", "missing_value", "valid_range", "valid_min", "valid_max"}
"""Attributes that change numbers."""
_NO_VALUE = 9.969209968386869e36
"""What NetCDF writes where no number was given (NC_FILL_DOUBLE); its float is the same rounded."""
_EXACT = 2.0**53
"""Whole numbers up to which a double holds all."""
_STEPS_OF_DIGIT = 2.0
"""Median step of whole numbers, in ones, from which on they may be rounded: of a step of one, a gap would be no more
than what rounding may do."""


class Unpacked(NamedTuple):
    """Numbers as they are meant, gaps as nan; resolution: step of the digits that they were stored in."""

    values: np.ndarray
    resolution: float


def unpacked(values: np.ndarray, attributes: Mapping[str, Any]) -> Unpacked:
    """Numbers of an array by its attributes, as xarray decodes them, and without those that are not in the valid range.

    Gaps are values equal to ``_FillValue`` or to one of ``missing_value``, outside of ``valid_range`` (``valid_min``,
    ``valid_max``), or never written. The others are multiplied by ``scale_factor`` and added to ``add_offset``; whole
    numbers with ``_Unsigned = "true"`` have no sign.

    Raises
    ------
    ValueError
        For an attribute that is not as it has to be.
    """
    stored = _as_signed(values, attributes)
    if stored.dtype.kind in "iu" and np.max(np.abs(stored)) >= _EXACT and not _PACKING & attributes.keys():
        return Unpacked(stored.astype(np.int64), 0.5)
    digits = _digits(stored)
    scale, offset = (_number(attributes, name) for name in ("scale_factor", "add_offset"))
    limits = _limits(attributes)
    fills = [*_numbers(attributes, "_FillValue"), *_numbers(attributes, "missing_value")]
    gap = np.zeros(stored.shape, dtype=bool)
    with np.errstate(invalid="ignore"):  # a fill value that the numbers cannot have
        for fill in fills:
            gap |= stored == np.asarray(fill).astype(stored.dtype)
    out = stored.astype(complex if stored.dtype.kind == "c" else float)
    if stored.dtype.kind == "f" and stored.dtype.itemsize > 2:
        gap |= stored == stored.dtype.type(_NO_VALUE)
    # a range of the type of the numbers as stored is of these, else of those that are meant
    of_stored = limits is not None and (limits[2] in "iu") == (stored.dtype.kind in "iub")
    if limits is not None and of_stored:
        gap |= _outside(out, limits)
    if scale is not None or offset is not None:
        out = out * (1.0 if scale is None else scale) + (offset or 0.0)
        digits *= abs(1.0 if scale is None else scale)
    if limits is not None and not of_stored:
        gap |= _outside(out, limits)
    out[gap] = np.nan
    return Unpacked(out, digits)


def _outside(values: np.ndarray, limits: tuple[float, float, str]) -> np.ndarray:
    """Where numbers, of complex ones their real parts, are outside of limits."""
    real = np.real(values)
    return (real < limits[0]) | (real > limits[1])


def unapplied(attributes: Mapping[str, Any]) -> list[str]:
    """Attributes that look like packing and are none by the conventions, as ``name = number``."""
    out = []
    for name, value in attributes.items():
        try:
            number = float(np.asarray(value).ravel()[0]) if np.size(value) == 1 else 1.0
        except (TypeError, ValueError):
            continue
        neutral = 0.0 if name.lower() in ("offset", "intercept") else 1.0
        if name.lower() in _LIKE_PACKING and number != neutral:
            out.append(f"{name} = {number:g}")
    return out


def _as_signed(values: np.ndarray, attributes: Mapping[str, Any]) -> np.ndarray:
    """Whole numbers with the sign that ``_Unsigned`` gives them."""
    said = attributes.get("_Unsigned")
    if said is None or values.dtype.kind not in "iu":
        return values
    text = said.decode() if isinstance(said, bytes) else str(np.asarray(said).ravel()[0])
    kind = {"true": "u", "false": "i"}.get(text.strip("b'\"").lower())
    if kind is None:
        raise ValueError(f"its attribute _Unsigned is '{text}', neither true nor false")
    return values.astype(f"{kind}{values.dtype.itemsize}")


def _digits(values: np.ndarray) -> float:
    """Half a one of whole numbers that may be rounded, the spacing of the largest of others."""
    largest = np.max(np.abs(values[np.isfinite(values)]), initial=0.0)
    if values.dtype.kind in "iub":
        steps = np.abs(np.diff(values.ravel().astype(float)))
        rounded = 0.5 if steps.size and np.median(steps) >= _STEPS_OF_DIGIT else 0.0
        return max(rounded, float(np.spacing(float(largest))))
    if values.dtype.kind not in "fc":
        return 0.0
    return float(np.spacing(np.asarray(largest).astype(np.real(values).dtype)))


def _numbers(attributes: Mapping[str, Any], name: str) -> list[Any]:
    """Numbers of an attribute, which may be text; those that are nan mark themselves."""
    if name not in attributes:
        return []
    array = np.asarray(attributes[name]).ravel()
    if array.dtype.kind in "SUO":
        try:
            array = np.array([float(one) for one in array])
        except (TypeError, ValueError):
            raise ValueError(f"its attribute {name} is no number") from None
    return [one for one in array if one == one]


def _number(attributes: Mapping[str, Any], name: str) -> float | None:
    found = _numbers(attributes, name)
    if len(found) > 1:
        raise ValueError(f"its attribute {name} has {len(found)} numbers, where one is applied")
    if name in attributes and not found:
        raise ValueError(f"its attribute {name} is no number")
    return float(found[0]) if found else None


def _limits(attributes: Mapping[str, Any]) -> tuple[float, float, str] | None:
    """Least and largest valid number, and the kind of numbers they are."""
    both = _numbers(attributes, "valid_range")
    if "valid_range" in attributes and len(both) != 2:
        raise ValueError("its attribute valid_range is not a pair of numbers")
    low = both[:1] or _numbers(attributes, "valid_min")[:1]
    high = both[1:] or _numbers(attributes, "valid_max")[:1]
    if not low and not high:
        return None
    kind = np.asarray((low or high)[0]).dtype.kind
    return float(low[0]) if low else -np.inf, float(high[0]) if high else np.inf, kind
