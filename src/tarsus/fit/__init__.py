"""Fits: unknown numbers of a scene, what its runs should do, exact derivatives of that, and optimisers for it."""

from tarsus.fit.by_cma import cma_es
from tarsus.fit.by_pymoo import pymoo_problem
from tarsus.fit.by_scipy import differential_evolution, least_squares, minimize
from tarsus.fit.problem import Problem
from tarsus.fit.residuals import Found, Residuals
from tarsus.fit.terms import Goal, Limit, Reading, Samples
from tarsus.fit.uncertainty import Uncertainty
from tarsus.fit.unknowns import Prior, Unknown, Unknowns

__all__ = [
    "Found",
    "Goal",
    "Limit",
    "Prior",
    "Problem",
    "Reading",
    "Residuals",
    "Samples",
    "Uncertainty",
    "Unknown",
    "Unknowns",
    "cma_es",
    "differential_evolution",
    "least_squares",
    "minimize",
    "pymoo_problem",
]
