"""Ground laws, one file a law; a user's own law is one more such file."""

from tarsus.laws.adhesion import Adhesion
from tarsus.laws.base import ImpactLaw, LatchLaw, Law, ResistiveLaw, SmoothLaw
from tarsus.laws.electrostatic import Electrostatic
from tarsus.laws.film import Film
from tarsus.laws.gravity import Gravity
from tarsus.laws.restitution import Restitution
from tarsus.laws.userfile import load_laws

__all__ = [
    "Adhesion",
    "Electrostatic",
    "Film",
    "Gravity",
    "ImpactLaw",
    "LatchLaw",
    "Law",
    "ResistiveLaw",
    "Restitution",
    "SmoothLaw",
    "load_laws",
]
