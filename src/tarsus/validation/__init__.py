"""Published experiments compared with what Tarsus computes of them: a folder each, claims written before runs."""

from tarsus.validation.experiment import PublishedExperiment, experiment_names, load_experiment
from tarsus.validation.measured import named
from tarsus.validation.result import Suite, Validation
from tarsus.validation.studyfile import RowCase
from tarsus.validation.verb import validate

__all__ = [
    "PublishedExperiment",
    "RowCase",
    "Suite",
    "Validation",
    "experiment_names",
    "load_experiment",
    "named",
    "validate",
]
