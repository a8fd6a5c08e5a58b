"""Uneven ground: its height along the way, one file a shape. A new file is a new shape, nothing else."""

from __future__ import annotations

import inspect
from functools import reduce
from operator import or_
from typing import TYPE_CHECKING, Annotated

from pydantic import Field

from tarsus.base.discover import classes_beside
from tarsus.model.profile.base import Profile, gaps_above, heights_of, line_between

__all__ = ["AnyProfile", "Profile", "gaps_above", "heights_of", "line_between"]


def _kind(shape: type[Profile]) -> str | None:
    field = shape.model_fields.get("kind")
    return None if field is None or inspect.isabstract(shape) else field.default


if TYPE_CHECKING:
    AnyProfile = Profile
else:
    AnyProfile = Annotated[
        reduce(or_, classes_beside(__package__, Profile, _kind).values()), Field(discriminator="kind")
    ]
    """Any shape; `kind` tells which."""
