"""Structures: linear dynamics with named points."""

from typing import Annotated

from pydantic import Field

from tarsus.model.structure.base import Matrices, Structure
from tarsus.model.structure.beam import Beam
from tarsus.model.structure.body_modes import body_modes
from tarsus.model.structure.linkage import Linkage
from tarsus.model.structure.lumped import Lumped
from tarsus.model.structure.modal import Modal
from tarsus.model.structure.walker import Payload, Walker, WalkerBody, WalkerLeg, WalkerMode, WalkerTip

__all__ = [
    "AnyStructure",
    "Beam",
    "Linkage",
    "Lumped",
    "Matrices",
    "Modal",
    "Payload",
    "Structure",
    "Walker",
    "WalkerBody",
    "WalkerLeg",
    "WalkerMode",
    "WalkerTip",
    "body_modes",
]

AnyStructure = Annotated[Modal | Lumped | Beam | Linkage | Walker, Field(discriminator="kind")]
"""Any structure; a table in a file says which by its ``kind``."""
