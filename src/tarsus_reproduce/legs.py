"""The packaged leg: Table 4.1 of the source, every number with its provenance."""

from __future__ import annotations

from typing import Annotated

from pydantic import AfterValidator

from tarsus.base.spec import Description, FrozenDict, validate
from tarsus.model.scene import Provenance
from tarsus.model.structure.leg import Leg
from tarsus_reproduce.packaged import data_table


class KnownLeg(Description):
    """A leg, and where each of its numbers comes from, by path inside the leg."""

    leg: Leg
    provenance: Annotated[dict[str, Provenance], AfterValidator(FrozenDict)]


def millipede_leg() -> KnownLeg:
    """The leg of the millipede prototype (Table 4.1), with what the source does not print as assumptions."""
    return validate(KnownLeg, data_table("millipede_leg.toml"))
