"""Modes from measurements: frequency responses, poles and shapes with intervals.

The package is also the verb of its name, ``tarsus.modes("plate.uff")``.
"""

from tarsus.base.verb import callable_package
from tarsus.modes.frf import Estimator, Frf, estimate_frf
from tarsus.modes.modal import ModalFit, identify_modes
from tarsus.modes.mode import IdentifiedMode, ModeVerdict
from tarsus.modes.mode_table import read_mode_table

__all__ = [
    "Estimator",
    "Frf",
    "IdentifiedMode",
    "ModalFit",
    "ModeVerdict",
    "estimate_frf",
    "identify_modes",
    "read_mode_table",
]

callable_package(__name__, "tarsus.modes.verb:modes")
