"""Fits: unknown numbers of a scene, what its runs should do, exact derivatives of that, and optimisers for it."""

from tarsus.fit.by_cma import cma_es
from tarsus.fit.by_pymoo import pymoo_problem
from tarsus.fit.by_scipy import differential_evolution, minimize
from tarsus.fit.chain import chain
from tarsus.fit.ensemble import Ensemble
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
    "Samples",
    "Scale",
    "Uncertainty",
    "Unknown",
    "Unknowns",
    "Verdict",
    "chain",
    "cma_es",
    "descend",
    "differential_evolution",
    "least_squares",
    "least_squares_from",
    "minimize",
    "pymoo_problem",
    "range_of",
]
