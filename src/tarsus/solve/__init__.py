"""Simulation: one run, or thousands at once. What makes derivatives is loaded when first used."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from tarsus.files.ledger import Ledger
from tarsus.solve.batch import simulate_batch
from tarsus.solve.codes import ResultCode
from tarsus.solve.engine import Accuracy
from tarsus.solve.results import Batch
from tarsus.solve.run import Run, load_run
from tarsus.solve.session import Session
from tarsus.solve.simulate import simulate

if TYPE_CHECKING:
    from tarsus.solve.gradients import Gradient, GradientBatch, GradientRun, gradient

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
    "load_run",
    "simulate",
    "simulate_batch",
]

_OF_GRADIENTS = ("Gradient", "GradientBatch", "GradientRun", "gradient")


def __getattr__(name: str) -> Any:
    if name not in _OF_GRADIENTS:
        raise AttributeError(f"module 'tarsus.solve' has no attribute '{name}'")
    from tarsus.solve import gradients

    return getattr(gradients, name)
