"""Packaged weighted ensembles: the members of a calibration that fit a device's table, as small files.

`docs/package_mixtures.py` calibrates the packaged studies and writes these files and the fitted devices.
"""

from __future__ import annotations

import json
from functools import lru_cache
from typing import Any

from tarsus.base.spec import with_values
from tarsus.calibrate.prediction import Miss
from tarsus.files.library import load_scene
from tarsus_reproduce.forecast import Member
from tarsus_reproduce.packaged import data_text

FILES = {"cantilever": "cantilever_mixture.json", "hexapod": "hexapod_mixture.json"}
"""Device -> the file of its ensemble."""


@lru_cache
def _packaged(device: str) -> dict[str, Any]:
    """The file of a device; empty for one without an ensemble."""
    if device not in FILES:
        return {}
    return json.loads(data_text(FILES[device]))


def packaged_members(device: str) -> tuple[Member, ...]:
    """The packaged ensemble of a device, as scenes with weights; empty for a device without one."""
    scene = load_scene(device)
    return tuple(
        Member(with_values(base, one["values"]), one["weight"])
        for branch in _packaged(device).get("branches", ())
        for base in [with_values(scene, {"name": f"{device}, {branch['name']}", **branch["set"]})]
        for one in branch["members"]
    )


def packaged_misses(device: str) -> dict[str, Miss]:
    """What a packaged ensemble misses of the measures of its study, by their names there; empty without one."""
    return {name: Miss(**one) for name, one in _packaged(device).get("discrepancy", {}).items()}


def packaged_errors(device: str) -> dict[str, Any] | None:
    """Errors of a packaged ensemble by its calibration, over the rows it was fitted to ("training") and over each as it
    was predicted without it ("left_out", None where no row was): by measure of the study `mean_relative_error`,
    `mean_absolute_error` in `unit`, `held` (share of values in their 80 % intervals) and `brier` (score of existence);
    and `held` of all; and what was chosen on the way (`told`, see `packaged_told`). None without an ensemble."""
    table = _packaged(device)
    return {**table["errors"], "told": packaged_told(device)} if table else None


def packaged_told(device: str) -> tuple[str, ...]:
    """What was chosen on the way to a packaged ensemble, a sentence each: options with their weights, interpretations
    of the table that are not in it, constraints with their reasons. Empty without an ensemble."""
    return tuple(_packaged(device).get("told", ()))
