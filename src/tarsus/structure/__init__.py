"""Structures: linear dynamics with named points."""

from typing import Annotated

from pydantic import Field

from tarsus.structure.base import Matrices, Structure
from tarsus.structure.beam import Beam
from tarsus.structure.lumped import Lumped
from tarsus.structure.modal import Modal
from tarsus.structure.walker import Walker, WalkerBody, WalkerLeg

__all__ = [
    "AnyStructure",
    "Beam",
    "Lumped",
    "Matrices",
    "Modal",
    "Structure",
    "Walker",
    "WalkerBody",
    "WalkerLeg",
]

AnyStructure = Annotated[Modal | Lumped | Beam | Walker, Field(discriminator="kind")]
"""Any structure; a table in a file says which by its ``kind``."""
