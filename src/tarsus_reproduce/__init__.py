"""The doctoral dissertation "Foot Impact and Dynamic Analyses of Piezoelectrically-Actuated Walking Micro-Robots",
reproduced with Tarsus: its devices, tables, studies and trends, and the pages that compare.

Tarsus finds all of it by entry points and imports none of it.
"""

from __future__ import annotations

from pathlib import Path

__all__ = ["DEVICES", "STUDIES"]

DEVICES = Path(__file__).parent / "devices"
"""Folder of the devices (entry point group ``tarsus.devices``)."""

STUDIES = Path(__file__).parent / "studies"
"""Folder of the studies (entry point group ``tarsus.studies``)."""
