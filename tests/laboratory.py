"""Devices for tests of what is measured, whose numbers stay when packaged devices are calibrated anew."""

from pathlib import Path

LABORATORY = Path(__file__).parent / "data" / "laboratory_cantilever.toml"
"""A cantilever whose foot is held unless it is pulled."""
HEXAPOD = LABORATORY.with_name("laboratory_hexapod.toml")
"""A hexapod whose first mode is damped by 1 % and whose film is thin."""
