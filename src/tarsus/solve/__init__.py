"""Simulation: one run, or thousands at once."""

from tarsus.solve.batch import Batch, simulate_batch
from tarsus.solve.engine import Accuracy
from tarsus.solve.gradients import Gradient, GradientBatch, GradientRun
from tarsus.solve.objective import gradient
from tarsus.solve.run import Ledger, ResultCode, Run
from tarsus.solve.session import Session
from tarsus.solve.simulate import simulate

__all__ = [
    "Accuracy",
    "Batch",
    "Gradient",
    "GradientBatch",
    "GradientRun",
    "Ledger",
    "ResultCode",
    "Run",
    "Session",
    "gradient",
    "simulate",
    "simulate_batch",
]
