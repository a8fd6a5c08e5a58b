"""A device fitted to a table of measures: every branch that fits, an ensemble in each, and what it predicts.

The package is also the verb of its name, ``tarsus.calibrate(study)``.
"""

from tarsus.base.verb import callable_package

callable_package(__name__, "tarsus.calibrate.calibrating:calibrate")
