"""The files of data that come with the package: experiments, tables as printed, unprinted numbers, ensembles."""

from __future__ import annotations

import tomllib
from dataclasses import dataclass
from functools import lru_cache
from importlib.resources import files
from typing import Any

PAGE_FILES = ("reproduction.csv", "reproduction.json", "reproduction.html")
"""What a comparison writes."""


def data_text(name: str) -> str:
    """The text of a packaged file."""
    return files("tarsus_reproduce").joinpath("data", name).read_text(encoding="utf-8")


def data_table(name: str, number: Any = float) -> dict[str, Any]:
    """A packaged TOML file, its numbers with a point as `number` reads them."""
    return tomllib.loads(data_text(name), parse_float=number)


@dataclass(frozen=True)
class Experiment:
    """A page: the experiment it is of, with which device (None: the packaged one), and what cannot be matched whatever
    the device."""

    name: str
    title: str
    experiment: str
    unmatched: tuple[str, ...]
    device: str | None = None


@lru_cache
def experiments() -> dict[str, Experiment]:
    """All experiments by name, in the order of the chapters (`data/experiments.toml`)."""
    return {
        name: Experiment(name, **{**table, "unmatched": tuple(table["unmatched"])})
        for name, table in data_table("experiments.toml").items()
    }
