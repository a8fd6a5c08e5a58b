"""Uneven ground: its height along the way, one file a shape. A new file is a new shape, nothing else."""

from __future__ import annotations

from functools import reduce
from operator import or_
from typing import TYPE_CHECKING, Annotated

from pydantic import Field

from tarsus.base.discover import classes_in_folder, kind_of_class
from tarsus.model.profile.base import GroundLine, Profile, Relief, gaps_above, heights_of, line_between
from tarsus.model.profile.each_foot import EachFoot

__all__ = [
    "AnyLine",
    "AnyProfile",
    "EachFoot",
    "GroundLine",
    "Profile",
    "Relief",
    "gaps_above",
    "heights_of",
    "line_between",
]


if TYPE_CHECKING:
    AnyLine = Profile
    AnyProfile = Relief
else:
    _shapes = tuple(classes_in_folder(__package__, Profile, kind_of_class).values())
    AnyLine = Annotated[reduce(or_, _shapes), Field(discriminator="kind")]
    """Any shape; `kind` says which."""
    EachFoot.model_rebuild(_types_namespace={"AnyLine": AnyLine})
    AnyProfile = Annotated[reduce(or_, (*_shapes, EachFoot)), Field(discriminator="kind")]
    """Any shape for all feet, or one a foot."""
