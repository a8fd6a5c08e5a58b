"""From a campaign's records to a device with error bars.

The package is also the verb of its name, ``tarsus.identify("lab/campaign.toml")``.
"""

import sys
from types import ModuleType
from typing import Any


class _Verb(ModuleType):
    """A package that can be called."""

    def __call__(self, campaign: Any, seed: int = 1, progress: Any = None) -> Any:
        """Identify a device from ``campaign.toml`` or its folder: an `Identification`, as
        `tarsus.identify.chain.identify` gives it. Raises InputError with every problem of the campaign."""
        from tarsus.identify.campaign import read_campaign
        from tarsus.identify.chain import identify

        return identify(read_campaign(campaign), seed, progress)


sys.modules[__name__].__class__ = _Verb
