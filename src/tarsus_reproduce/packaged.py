"""The files of data that come with the package: tables as printed, unprinted numbers, ensembles."""

from __future__ import annotations

import tomllib
from importlib.resources import files
from typing import Any


def data_text(name: str) -> str:
    """The text of a packaged file."""
    return files("tarsus_reproduce").joinpath("data", name).read_text(encoding="utf-8")


def data_table(name: str, number: Any = float) -> dict[str, Any]:
    """A packaged TOML file, its numbers with a point as `number` reads them."""
    return tomllib.loads(data_text(name), parse_float=number)
