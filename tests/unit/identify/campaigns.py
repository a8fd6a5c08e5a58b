"""A small synthetic campaign on a cantilever whose numbers nobody knows, made once for all tests of the chain."""

from __future__ import annotations

import shutil
import tempfile
from dataclasses import replace
from functools import lru_cache
from pathlib import Path

from tarsus.experiment.campaign_folder import write_campaign
from tarsus.experiment.synthesis import Instrument, Purpose, perturbed, planned
from tarsus.files.library import load_scene
from tarsus.identify.campaign import read_campaign
from tarsus.identify.chain import Identification, identify
from tarsus.scene import Scene

KEPT = (
    "loops",
    "ramps-5hz-100",
    "ramps-20hz-50",
    "ramps-60hz-100",
    "held-out-square-8v-50hz",
    "held-out-sine-6v-100hz",
)
ONCE = "ramps-60hz-100"
"""Recorded once: eight flights in a record. The others, of fewer, are repeated."""


@lru_cache(maxsize=1)
def truth() -> Scene:
    """The device behind the records."""
    return perturbed(load_scene("cantilever"), 0.2, seed=7)


@lru_cache(maxsize=1)
def folder() -> Path:
    """The campaign's folder; copy it before changing anything (`copied`)."""
    target = Path(tempfile.mkdtemp(prefix="tarsus-campaign-"))
    takes = []
    for take in planned(truth(), 20e3, "pzt"):
        if take.purpose is Purpose.MODAL:
            takes.append(take)
        elif take.purpose is Purpose.BOUNCES or take.name in KEPT:
            once = take.purpose is Purpose.BOUNCES or take.name == ONCE
            takes.append(replace(take, repeats=1 if once else take.repeats, air=None))
    write_campaign(truth(), target, Instrument(), 7, takes=takes)
    return target


@lru_cache(maxsize=1)
def identified() -> Identification:
    """What the chain finds in it."""
    return identify(read_campaign(folder()))


def copied(target: Path) -> Path:
    """A copy of the folder that may be damaged."""
    shutil.copytree(folder(), target)
    return target
