"""Wrong data: each fault is one sentence with file, channel and cause, and the rest goes on."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest
from identify.campaigns import copied
from scipy.io import loadmat, savemat

from tarsus.errors import InputError
from tarsus.identify.campaign import read_campaign
from tarsus.identify.chain import Chain
from tarsus.identify.resonance import identify_resonances
from tarsus.identify.restitution import identify_restitution

MAT = "ramps-20hz-50-2.mat"


def changed(folder: Path, change: Callable[[dict[str, Any]], object], file: str = MAT) -> None:
    content = {k: v for k, v in loadmat(folder / file, simplify_cells=True).items() if not k.startswith("__")}
    change(content)
    savemat(folder / file, content)


def said(folder: Path) -> list[str]:
    chain = Chain(read_campaign(folder))
    chain.read()
    chain.find_ground()
    return [str(one) for one in chain.left_out]


def swap(content: dict[str, Any]) -> None:
    for kind in ("displacement", "velocity"):
        tip, center = f"tip_{kind}", f"center_{kind}"
        content[tip], content[center] = content[center], content[tip]


def gap(content: dict[str, Any]) -> None:
    content["tip_velocity"][100:130] = np.nan


def clip(content: dict[str, Any]) -> None:
    content["tip_displacement"] = np.minimum(content["tip_displacement"], 40.0)


def drive(change: Callable[[np.ndarray], np.ndarray]) -> Callable[[dict[str, Any]], None]:
    return lambda content: content.update(pzt_volts=change(content["pzt_volts"]))


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (clip, ["tip_displacement", "clipped"]),
        (gap, ["tip_velocity", "1 gap", "sample 100"]),
        (lambda c: c.update(fs=25e3), ["pzt volts", "sampling rate of 25000 Hz is wrong", "2e+04 Hz"]),
        (swap, ["'tip' and 'center' look swapped"]),
        (lambda c: c.pop("pzt_volts"), ["drive is missing", "no channel 'pzt_volts'"]),
        (drive(lambda volts: 0.0 * volts), ["drive is missing", "pzt_volts"]),
        (drive(lambda volts: 0.5 * volts), ["pzt volts", "0.5 times"]),
        (drive(lambda volts: np.roll(volts, 300)), ["pzt volts", "not the one that the campaign states"]),
    ],
)
def test_a_damaged_record_is_left_out_with_its_reason(tmp_path, change, words):
    folder = copied(tmp_path / "campaign")
    changed(folder, change)
    told = said(folder)
    assert len(told) == 1 and told[0].startswith(MAT), told
    for word in words:
        assert word in told[0]


@pytest.mark.parametrize("file", ["sweep-2.uff", "loops-1.txt", MAT])
def test_a_truncated_file_is_left_out(tmp_path, file):
    folder = copied(tmp_path / "campaign")
    content = (folder / file).read_bytes()
    (folder / file).write_bytes(content[: len(content) * 3 // 5])
    told = said(folder)
    assert len(told) == 1 and told[0].startswith(file) and "truncated" in told[0]


def test_swapped_channels_of_sweeps_are_told_by_the_modes(tmp_path):
    folder = copied(tmp_path / "campaign")
    text = (folder / "campaign.toml").read_text(encoding="utf-8")
    text = text.replace('unit = "m/s"\npoint = "tip"', 'unit = "m/s"\npoint = "other"')
    text = text.replace('unit = "m/s"\npoint = "center"', 'unit = "m/s"\npoint = "tip"')
    (folder / "campaign.toml").write_text(text.replace('"other"', '"center"'), encoding="utf-8")
    chain = Chain(read_campaign(folder))
    chain.read()
    read = [one.record for one in chain.readings if one.file.startswith("sweep")]
    records = [record for record in read if record is not None]
    with pytest.raises(
        InputError, match=r"sweep-1.uff.*channels 'center' and 'tip' look swapped|'tip' and 'center'"
    ):
        identify_resonances(chain.opened.model, records, (200.0, 8900.0), 1)


def test_too_few_bounces_are_counted(tmp_path):
    folder = copied(tmp_path / "campaign")
    for file in folder.glob("bounces-*.h5"):
        with h5py.File(file, "a") as content:
            for name in [key for key in content if content[key].shape]:
                values, attrs = content[name][:230], dict(content[name].attrs)
                del content[name]
                content.create_dataset(name, data=values).attrs.update(attrs)
    chain = Chain(read_campaign(folder))
    chain.read()
    chain.find_ground()
    traces = next(found for purpose, found in chain.traces.items() if purpose.value == "bounces")
    with pytest.raises(InputError, match=r"bounces-.*\.h5: channel 'tip' shows \d bounces .* at least 5"):
        identify_restitution(chain.opened.model, chain.known, traces, chain.level[0], 1)


def test_a_campaign_file_tells_all_its_faults_at_once(tmp_path):
    folder = copied(tmp_path / "campaign")
    text = (folder / "campaign.toml").read_text(encoding="utf-8")
    text = text.replace('foot = "tip"', 'foot = "tipp"').replace('"sweep-3.uff"', '"sweep-33.uff"')
    (folder / "campaign.toml").write_text(text, encoding="utf-8")
    with pytest.raises(InputError) as caught:
        read_campaign(folder)
    assert caught.value.problems == [
        "campaign.toml: records.sweep-3.files: there is no file 'sweep-33.uff'",
        "campaign.toml: foot: the device has no foot 'tipp'; did you mean 'tip'?",
    ]
    (folder / "campaign.toml").write_text("records = 3\n", encoding="utf-8")
    with pytest.raises(InputError, match=r"campaign.toml: "):
        read_campaign(folder)
