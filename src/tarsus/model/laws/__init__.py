"""Ground laws, one file a law; a user's own law is one more such file."""

from tarsus.model.laws.adhesion import Adhesion
from tarsus.model.laws.base import ImpactLaw, LatchLaw, Law, ResistiveLaw, SmoothLaw
from tarsus.model.laws.electrostatic import Electrostatic
from tarsus.model.laws.film import Film
from tarsus.model.laws.friction import AdhesiveFriction, AnyFriction, Friction
from tarsus.model.laws.gravity import Gravity
from tarsus.model.laws.impact_map import AnyImpactMap, DominantMode, Given, ImpactMap, MassWeighted
from tarsus.model.laws.landing import AnyLanding, CaptureUnlessPulled, Landing, PullAsPrinted, RestituteFirst
from tarsus.model.laws.leg_electrostatic import LegElectrostatic
from tarsus.model.laws.restitution import Restitution
from tarsus.model.laws.userfile import load_laws

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
