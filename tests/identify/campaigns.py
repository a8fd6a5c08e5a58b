"""A small synthetic campaign on a cantilever whose numbers nobody knows, made once for all tests of the chain."""

from __future__ import annotations

import re
import shutil
import tempfile
from collections.abc import Callable
from dataclasses import replace
from functools import lru_cache
from pathlib import Path
from typing import Any

import pytest
from scipy.io import loadmat, savemat

from laboratory import LABORATORY
from once import once
from tarsus.base.spec import FrozenDict
from tarsus.files.library import load_scene
from tarsus.files.toml import description_text, scene_text
from tarsus.identify.campaign import Opened, read_campaign
from tarsus.identify.chain import Identification, StepRunner, identify
from tarsus.model.scene import Scene
from tarsus.records.purpose import Purpose
from tarsus.synthesis.campaign_folder import write_campaign
from tarsus.synthesis.devices import perturbed
from tarsus.synthesis.plan import planned
from tarsus.synthesis.recordings import Instrument

KEPT = (
    "sweep-1",
    "sweep-2",
    "sweep-3",
    "sweep-4",
    "loops",
    "ramps-5hz-100",
    "ramps-20hz-50",
    "ramps-60hz-100",
    "held-out-square-8v-50hz",
    "held-out-sine-6v-100hz",
)
MAT = "ramps-20hz-50-2.mat"
"""One of the files."""
ONCE = "ramps-60hz-100"
"""Recorded once: eight flights in a record. The others, of fewer, are repeated."""


@lru_cache(maxsize=1)
def truth() -> Scene:
    """The device behind the records."""
    return perturbed(load_scene(LABORATORY), 0.2, seed=7)


@once
def folder() -> Path:
    """The campaign's folder; copy it before changing anything (`copied`)."""
    target = Path(tempfile.mkdtemp(prefix="tarsus-campaign-"))
    takes, plan = [], planned(truth(), 20e3, "pzt")
    bounces = [one.name for one in plan if one.purpose is Purpose.BOUNCES][:2]
    for take in plan:
        if take.name in KEPT or take.name in bounces:
            once = take.purpose is Purpose.BOUNCES or take.name == ONCE
            takes.append(replace(take, repeats=1 if once else take.repeats, air=None))
    write_campaign(truth(), target, Instrument(), 7, recordings=takes)
    return target


def session(target: Path, device: Scene, seed: int) -> Path:
    """A short session on a device: everything but the bounces."""
    wanted = (*KEPT[:6], "ramps-60hz-100")
    write_campaign(
        device, target, Instrument(), seed, recordings=[r for r in planned(device, 20e3, "pzt") if r.name in wanted]
    )
    return target


@once
def identified() -> Identification:
    """What the chain finds in it."""
    return identify(read_campaign(folder()))


def modes_as_found(patch: pytest.MonkeyPatch) -> None:
    """Give the chain the modes that the whole campaign has told, which take longest to find again."""
    found = identified().resonances  # before it is patched: the campaign may not have been identified yet
    patch.setattr("tarsus.identify.steps.identify_resonances", lambda *words: found)


def copied(target: Path, *purposes: str) -> Path:
    """A copy of the folder that may be damaged; of the sets of some purposes or names alone, where they are given."""
    shutil.copytree(folder(), target)
    campaign = read_campaign(target).campaign
    sets = {name: one.model_copy(update={"like": None}) for name, one in campaign.records.items()}
    spelled_out = campaign.model_copy(update={"records": FrozenDict(sets)})
    (target / "campaign.toml").write_text(description_text(spelled_out), encoding="utf-8")
    if purposes:
        only(target, *purposes)
    return target


def of_known_structure(target: Path) -> None:
    """A copy of the records that tell of film and adhesion, on a device whose structure is known: identified in a
    second."""
    copied(target, "loops", "ramps")
    (target / "device.toml").write_text(scene_text(truth()), encoding="utf-8")


def grounded(opened: Opened) -> StepRunner:
    """The chain before its first step, its records read and their ground found."""
    chain = StepRunner.of(opened)
    chain.read()
    chain.find_ground()
    return chain


def said(folder: Path) -> list[str]:
    """What is excluded before any step, a sentence each."""
    return [str(one) for one in grounded(read_campaign(folder)).evidence.left_out]


def changed(folder: Path, change: Callable[[dict[str, Any]], object], file: str = MAT) -> None:
    """Change the content of a MATLAB file by its names."""
    content = {k: v for k, v in loadmat(folder / file, simplify_cells=True).items() if not k.startswith("__")}
    change(content)
    savemat(folder / file, content)


def only(folder: Path, *purposes: str) -> None:
    """Keep the sets of some purposes, or of some names."""
    text = (folder / "campaign.toml").read_text(encoding="utf-8")
    head, *sets = re.split(r"(?m)^(?=\[records\.[^.\]]+\]$)", text)
    wanted = "|".join(purposes)
    kept = [one for one in sets if re.search(rf'purpose = "({wanted})"|^\[records\.({wanted})\]', one)]
    (folder / "campaign.toml").write_text(head + "".join(kept), encoding="utf-8")
