"""From a folder of vibrometer files to a device with error bars, and back to the records it has not seen.

    python examples/identify_campaign.py

No raw records of the source exist, so a campaign is made first: a cantilever whose numbers are drawn within 20 % of the
packaged one, recorded at 20 kHz with noise 40 dB below its motion, 61 files in five formats as a laboratory would hand
them over. Nothing below the line "identify" knows the truth until the last table.
"""

from __future__ import annotations

import tempfile
from dataclasses import dataclass
from pathlib import Path

import numpy as np

import tarsus as ts
from tarsus.base.spec import float_paths
from tarsus.identify.assessment import assessed
from tarsus.identify.campaign import read_campaign
from tarsus.identify.chain import Identification, identify
from tarsus.identify.result import identified_device
from tarsus.synthesis.campaign_folder import write_campaign
from tarsus.synthesis.devices import perturbed
from tarsus.synthesis.recordings import Instrument

SHOWN = (
    "robot.structure.frequencies.0",
    "robot.structure.damping_ratios.0",
    "ground.restitution.coefficient",
    "ground.adhesion.initial",
    "ground.adhesion.rate",
    "ground.film.thickness",
)


@dataclass(frozen=True)
class Story:
    """The device behind the records, what the records tell, and the device made of it."""

    truth: ts.Scene
    found: Identification
    device: ts.Scene


def identified(seed: int = 8) -> Story:
    """Record a campaign on an unknown device, and identify it."""
    truth = perturbed(ts.load_scene("cantilever-capture"), 0.2, seed)
    with tempfile.TemporaryDirectory() as folder:
        write_campaign(truth, Path(folder), Instrument(snr_db=40.0), seed)
        # identify
        found = identify(read_campaign(folder))
    return Story(truth, found, identified_device(found))


def text(story: Story) -> str:
    """Numbers with intervals and verdicts beside the truth, and how held-out records are met."""
    true, found = float_paths(story.truth), story.found
    steps = {path: step for step in found.steps.values() for path in step.paths}
    judged = assessed(found)
    lines = [f"{'number':36s} {'found':>10s} {'95 % interval':>24s} {'truth':>10s}  verdict"]
    for path in SHOWN:
        low, high = steps[path].interval(path)
        word = "" if judged is None else judged[path].word
        value = steps[path].value(path)
        lines.append(f"{path:36s} {value:10.4g} {low:11.4g} to {high:9.4g} {true[path].value:10.4g}  {word}")
    missed = [one.off for one in found.comparisons]
    lines.append(f"{len(missed)} held-out records: {100 * np.median(missed):.2g} % of the motion is missed (median)")
    lines.append(f"{found.files_used} of {len(found.readings)} files used")
    return "\n".join(lines)


if __name__ == "__main__":
    print(text(identified()))
