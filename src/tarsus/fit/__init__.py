"""Fits: unknown numbers of a scene, what its runs should do, derivatives of that, and optimisers for it.

The package is also the verb of its name, ``tarsus.fit(scene, unknowns, residuals)``.
"""

from tarsus.base.verb import callable_package
from tarsus.fit.adapters import cma_es
from tarsus.fit.chain import chain
from tarsus.fit.ensemble import Ensemble
from tarsus.fit.fitting import FitResult, fit
from tarsus.fit.least_squares import least_squares, least_squares_from
from tarsus.fit.normal_equations import Descent, Minimum, NormalEquations, descend
from tarsus.fit.problem import Problem
from tarsus.fit.ranges import Range, range_of
from tarsus.fit.residuals import Found, Residuals
from tarsus.fit.terms import Limit, Reading, Samples
from tarsus.fit.uncertainty import Uncertainty
from tarsus.fit.unknowns import Prior, Scale, Unknown, Unknowns
from tarsus.fit.verdict import Verdict

__all__ = [
    "Descent",
    "Ensemble",
    "FitResult",
    "Found",
    "Limit",
    "Minimum",
    "NormalEquations",
    "Prior",
    "Problem",
    "Range",
    "Reading",
    "Residuals",
    "Samples",
    "Scale",
    "Uncertainty",
    "Unknown",
    "Unknowns",
    "Verdict",
    "chain",
    "cma_es",
    "descend",
    "fit",
    "least_squares",
    "least_squares_from",
    "range_of",
]

callable_package(__name__, "tarsus.fit.fitting:fit")

_FORMER = {
    "Goal": "tarsus.design, whose objectives are measures by name",
    "pymoo_problem": "tarsus.design with several objectives, which gives a front",
    "minimize": "tarsus.fit.least_squares; scipy's takes a problem's cost, gradient and bounds",
}
"""What to use in place of names of earlier versions."""


def __getattr__(name: str) -> object:
    if name == "RunResiduals":  # of earlier versions: a problem takes the function in place of terms
        return Problem
    if name in _FORMER:
        raise ImportError(f"tarsus.fit.{name} is gone; use {_FORMER[name]}")
    raise AttributeError(f"module 'tarsus.fit' has no attribute '{name}'")
