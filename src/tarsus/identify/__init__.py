"""From a campaign of records to a device with intervals and verdicts.

The package is also the verb of its name, ``tarsus.identify("lab/campaign.toml")``.
"""

from tarsus.base.verb import callable_package

callable_package(__name__, "tarsus.identify.verb:identify")
