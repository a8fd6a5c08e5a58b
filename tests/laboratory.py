"""The device that tests of identification measure: a cantilever whose foot is held unless it is pulled."""

from pathlib import Path

LABORATORY = Path(__file__).parent / "data" / "laboratory_cantilever.toml"
"""Its numbers stay when packaged devices are calibrated anew."""
