"""From records to a model with error bars: frequency responses, modes.

The package is also the verb of its name, ``tarsus.identify("lab/campaign.toml")``.
"""

import sys
from types import ModuleType
from typing import Any

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


class _Verb(ModuleType):
    """A package that can be called."""

    def __call__(self, *args: Any, **options: Any) -> Any:
        from tarsus.identify.chain import identify

        return identify(*args, **options)


sys.modules[__name__].__class__ = _Verb
