"""Fits: unknown numbers of a scene, what its runs should do, derivatives of that, and optimisers for it.

The package is also the verb of its name, ``tarsus.fit(scene, unknowns, residuals)``.
"""

from tarsus.base.verb import callable_package
from tarsus.fit.adapters import cma_es, minimize, pymoo_problem
from tarsus.fit.chain import chain
from tarsus.fit.ensemble import Ensemble
from tarsus.fit.fitting import FitResult, RunResiduals, fit
from tarsus.fit.least_squares import least_squares, least_squares_from
from tarsus.fit.normal_equations import Descent, Minimum, NormalEquations, descend
from tarsus.fit.problem import Problem
from tarsus.fit.ranges import Range, range_of
from tarsus.fit.residuals import Found, Residuals
from tarsus.fit.terms import Goal, Limit, Reading, Samples
from tarsus.fit.uncertainty import Uncertainty
from tarsus.fit.unknowns import Prior, Scale, Unknown, Unknowns
from tarsus.fit.verdict import Verdict

__all__ = [
    "Descent",
    "Ensemble",
    "FitResult",
    "Found",
    "Goal",
    "Limit",
    "Minimum",
    "NormalEquations",
    "Prior",
    "Problem",
    "Range",
    "Reading",
    "Residuals",
    "RunResiduals",
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
    "minimize",
    "pymoo_problem",
    "range_of",
]

callable_package(__name__, "tarsus.fit.fitting:fit")
