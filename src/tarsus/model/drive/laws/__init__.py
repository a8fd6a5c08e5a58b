"""Laws from voltage to force, one file a law; a file added here is another one.

That come with the library: linear, the printed two branches (2.9), and the closed hysteresis operator.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import lru_cache, reduce
from operator import or_
from typing import TYPE_CHECKING, Annotated

from pydantic import Field

from tarsus.base.discover import classes_in_folder, kind_of_class
from tarsus.model.drive.law import Cubic, VoltageLaw
from tarsus.model.drive.laws.creeping import Creeping, fit_rates
from tarsus.model.drive.laws.linear import LinearForce
from tarsus.model.drive.laws.prandtl_ishlinskii import PrandtlIshlinskii, fit_branches
from tarsus.model.drive.laws.two_branch import TwoBranch

__all__ = [
    "Creeping",
    "Cubic",
    "ForceLaw",
    "LinearForce",
    "PrandtlIshlinskii",
    "TwoBranch",
    "VoltageLaw",
    "fit_branches",
    "fit_rates",
]


@lru_cache(maxsize=1)
def built_in() -> Mapping[str, type[VoltageLaw]]:
    """Laws by kind, in the order of their files: every one with a field ``kind``."""
    return classes_in_folder(__name__, VoltageLaw, kind_of_class)


if TYPE_CHECKING:
    ForceLaw = VoltageLaw
else:
    ForceLaw = Annotated[reduce(or_, built_in().values()), Field(discriminator="kind")]
    """Any law from volts to force; `kind` says which."""
