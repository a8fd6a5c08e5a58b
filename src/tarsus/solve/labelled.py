"""Measures of many runs as labelled arrays: the variables of a batch and of a sweep's file."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from tarsus.base.spec import float_paths
from tarsus.files.series import Variable
from tarsus.solve.codes import ResultCode

if TYPE_CHECKING:
    from tarsus.measure import Measure, Measured
    from tarsus.solve.results import Batch


def measure_variables(
    name: str,
    about: Measure | Measured,
    dims: tuple[str, ...],
    value: np.ndarray,
    spread: np.ndarray,
    per_foot: np.ndarray | None,
    notes: Mapping[str, Any],
) -> dict[str, Variable]:
    """A measure as variables over ``dims``: value and spread of their shape, and that of each foot where given."""
    notes = {"units": about.unit, "scope": str(about.scope), **notes}
    out = {
        name: Variable(dims, value, {"long_name": about.definition, **notes}),
        f"{name}_spread": Variable(
            dims, spread, {"long_name": f"standard deviation of {name} from period to period", **notes}
        ),
    }
    if per_foot is not None:
        out[f"{name}_per_foot"] = Variable(
            (*dims, "foot"), per_foot, {"long_name": f"{name} of each foot", **notes}
        )
    return out


def outcome_variable(
    numbers: np.ndarray, meanings: Mapping[str, str], dims: tuple[str, ...], notes: Mapping[str, Any]
) -> Variable:
    """How runs ended: numbers of names, each with its sentence, as flags."""
    flags = {"flag_values": np.arange(len(meanings), dtype=np.int8), "flag_meanings": " ".join(meanings)}
    return Variable(dims, numbers, {"long_name": "how the run ended", **flags, **meanings, **notes})


def batch_variables(batch: Batch, found: Mapping[str, Measured]) -> dict[str, Variable]:
    """Varied values, outcomes and measures of a batch by name; see `tarsus.solve.results.Batch.to_dataset`."""
    dims, shape = tuple(batch.axes) or ("run",), batch.shape
    known, feet = float_paths(batch.scene), list(batch.scene.robot.feet)
    out: dict[str, Variable] = {}
    for path, values in (batch.axes or batch.vary).items():
        about = known[path]
        notes = {"units": about.unit, "long_name": about.doc or path}
        out[path] = Variable((path,) if batch.axes else dims, values, notes)
    meanings = {code.name: code.value for code in ResultCode}
    number = {code: np.int8(i) for i, code in enumerate(ResultCode)}
    codes = np.array([number[code] for code in batch.codes]).reshape(shape)
    out["code"] = outcome_variable(codes, meanings, dims, {})
    for name, one in found.items():
        each = one.per_foot.reshape(*shape, len(feet)) if one.per_foot is not None and len(feet) > 1 else None
        out |= measure_variables(
            name, one, dims, one.value.reshape(shape), one.spread.reshape(shape), each, {}
        )
    if any("foot" in variable.dims for variable in out.values()):
        out["foot"] = Variable(("foot",), np.array(feet), {})
    return out
