"""Types of what verbs take, by the names that a command line knows how to write (`tarsus.cli.words`)."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence

Quantity = float | str
"""A number in SI, or a text with its unit: ``6.0``, ``"6 V"``."""

Range = tuple[Quantity, Quantity]
"""Both ends of a range."""

Ranges = Mapping[str, Range]
"""Both ends of a range by path."""

Values = Mapping[str, Quantity | Sequence[Quantity] | None]
"""Values by name, None of a name alone."""

Quantities = Mapping[str, Quantity]
"""One value by name."""

Counts = tuple[int, int]
"""Fewest and most."""

Axis = tuple[str, Quantity, Quantity] | tuple[str, Quantity, Quantity, str]
"""A path, both ends of its range, and "log" where values go by equal factors."""

ProgramOptions = str
"""Words for another program; they may begin with a hyphen."""

FilePath = str | os.PathLike[str]
"""A file or a folder."""
