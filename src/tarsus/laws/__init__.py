"""Ground laws, one file a law; a user's own law is one more such file."""

from tarsus.laws.adhesion import Adhesion
from tarsus.laws.base import ImpactLaw, LatchLaw, Law, ResistiveLaw, SmoothLaw
from tarsus.laws.electrostatic import Electrostatic
from tarsus.laws.film import Film
from tarsus.laws.friction import AdhesiveFriction, AnyFriction, Friction
from tarsus.laws.gravity import Gravity
from tarsus.laws.impact_map import AnyImpactMap, DominantMode, Given, ImpactMap, MassWeighted
from tarsus.laws.landing import AnyLanding, CaptureUnlessPulled, Landing, PullAsPrinted, RestituteFirst
from tarsus.laws.leg_electrostatic import LegElectrostatic
from tarsus.laws.restitution import Restitution
from tarsus.laws.userfile import load_laws

__all__ = [
    "Adhesion",
    "AdhesiveFriction",
    "AnyFriction",
    "AnyImpactMap",
    "AnyLanding",
    "CaptureUnlessPulled",
    "DominantMode",
    "Electrostatic",
    "Film",
    "Friction",
    "Given",
    "Gravity",
    "ImpactLaw",
    "ImpactMap",
    "Landing",
    "LatchLaw",
    "Law",
    "LegElectrostatic",
    "MassWeighted",
    "PullAsPrinted",
    "ResistiveLaw",
    "RestituteFirst",
    "Restitution",
    "SmoothLaw",
    "load_laws",
]
