"""From records to a model with error bars: frequency responses, modes.

The package is also the verb of its name, ``tarsus.identify("lab/campaign.toml")``.
"""

from tarsus.base.verb import callable_package
from tarsus.identify.circle import CircleFit, fit_mode_circle
from tarsus.identify.frf import Estimator, Frf, estimate_frf
from tarsus.identify.modal import IdentifiedMode, ModalFit, Verdict, identify_modes

__all__ = [
    "CircleFit",
    "Estimator",
    "Frf",
    "IdentifiedMode",
    "ModalFit",
    "Verdict",
    "estimate_frf",
    "fit_mode_circle",
    "identify_modes",
]

callable_package(__name__, "tarsus.identify.chain:identify")
