"""Ground laws, one file a law; a user's own law is one more such file."""

from tarsus.model.laws.adhesion import Adhesion
from tarsus.model.laws.base import AdhesionLaw, DampingLaw, FrictionLaw, ImpactLaw, Law, SmoothLaw
from tarsus.model.laws.electro_adhesion import ElectroAdhesion
from tarsus.model.laws.electrostatic import Electrostatic
from tarsus.model.laws.film import Film
from tarsus.model.laws.friction import AdhesiveFriction, AnyFriction, Friction
from tarsus.model.laws.fringing_field import FringingField
from tarsus.model.laws.gravity import Gravity
from tarsus.model.laws.impact_map import AnyImpactMap, DominantMode, ImpactMap, MassWeighted, MeasuredImpactMap
from tarsus.model.laws.landing import AnyLanding, CaptureUnlessPulled, Landing, PullAsPrinted, RestituteFirst
from tarsus.model.laws.leg_electrostatic import LegElectrostatic
from tarsus.model.laws.power_restitution import PowerRestitution
from tarsus.model.laws.rarefied_film import RarefiedFilm
from tarsus.model.laws.restitution import Restitution
from tarsus.model.laws.static_friction import StaticKineticFriction
from tarsus.model.laws.userfile import load_laws

__all__ = [
    "Adhesion",
    "AdhesionLaw",
    "AdhesiveFriction",
    "AnyFriction",
    "AnyImpactMap",
    "AnyLanding",
    "CaptureUnlessPulled",
    "DampingLaw",
    "DominantMode",
    "ElectroAdhesion",
    "Electrostatic",
    "Film",
    "Friction",
    "FrictionLaw",
    "FringingField",
    "Gravity",
    "ImpactLaw",
    "ImpactMap",
    "Landing",
    "Law",
    "LegElectrostatic",
    "MassWeighted",
    "MeasuredImpactMap",
    "PowerRestitution",
    "PullAsPrinted",
    "RarefiedFilm",
    "RestituteFirst",
    "Restitution",
    "SmoothLaw",
    "StaticKineticFriction",
    "load_laws",
]
