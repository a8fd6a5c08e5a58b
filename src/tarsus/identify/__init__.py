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

    def __call__(self, campaign: Any, seed: int = 1, progress: Any = None) -> Any:
        """Identify a device from ``campaign.toml`` or its folder: an `Identification`, as
        `tarsus.identify.chain.identify` gives it. Raises InputError with every problem of the campaign."""
        from tarsus.identify.campaign import read_campaign
        from tarsus.identify.chain import identify

        return identify(read_campaign(campaign), seed, progress)


sys.modules[__name__].__class__ = _Verb
