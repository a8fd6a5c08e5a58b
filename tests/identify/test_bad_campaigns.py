"""Wrong data: each fault is one sentence with file, channel and cause, and the rest goes on. What is told of a wrong
drive is in test_drive_check.py."""

from __future__ import annotations

import shutil
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import h5py
import numpy as np
import pytest

from identify.campaigns import MAT, changed, copied, grounded, said, truth
from identify.campaigns import folder as folder_of_all
from tarsus.base.errors import InputError
from tarsus.identify.campaign import checked_drive, read_campaign, read_records
from tarsus.identify.chain import StepRunner, identify
from tarsus.identify.readiness import readiness_of
from tarsus.identify.resonance import identify_resonances
from tarsus.identify.restitution import identify_restitution
from tarsus.model.structure import Beam
from tarsus.modes.agreement import agreeing
from tarsus.records.measurement import Channel, Measurement, Quantity
from tarsus.records.purpose import Purpose
from tarsus.synthesis.record_files import write_uff


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


def by(change: Callable[[np.ndarray], np.ndarray], *names: str) -> Callable[[dict[str, Any]], None]:
    return lambda content: content.update({name: change(content[name]) for name in names})


def drawn_out(samples: int) -> Callable[[np.ndarray], np.ndarray]:
    return lambda volts: np.concatenate([np.zeros(samples), volts[:-samples]])


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (clip, ["tip_displacement", "clipped"]),
        (gap, ["tip_velocity", "1 gap", "sample 100"]),
        (lambda c: c.update(fs=25e3), ["pzt volts", "not the one that the campaign states", "rate of 25000 Hz right?"]),
        (swap, ["'tip' and 'center' look swapped"]),
        (lambda c: c.pop("pzt_volts"), ["drive is missing", "no channel 'pzt_volts'"]),
        (drive(lambda volts: 0.0 * volts), ["drive is missing", "pzt_volts"]),
        (drive(lambda volts: 0.5 * volts), ["pzt volts", "0.5 times", "unit or scale"]),
        (drive(lambda volts: volts + 0.4), ["pzt volts", "+0.4 V off"]),
        (drive(drawn_out(10)), ["pzt volts", "0.5 ms late", "10 samples", "rest of 10 ms"]),
        (by(lambda x: 1.1 * x, "tip_displacement"), ["'tip'", "times the integral of the velocity: are units"]),
        (by(lambda v: -v, "tip_velocity"), ["'tip'", "displacement and velocity have opposite signs"]),
        (by(lambda x: x + 8.0 * (np.arange(len(x)) > 300), "tip_displacement"), ["'tip'", "8.12 um higher"]),
        (by(lambda x: 1.15 * x, "tip_displacement", "tip_velocity"), ["'tip'", "1.15 times as much"]),
    ],
)
def test_a_damaged_record_is_left_out_with_its_reason(tmp_path, change, words):
    folder = copied(tmp_path / "campaign", "ramps-20hz-50")
    changed(folder, change)
    told = said(folder)
    assert len(told) == 1 and told[0].startswith(MAT), told
    for word in words:
        assert word in told[0]


def test_files_that_do_not_count_are_told_and_the_others_read(tmp_path):
    """Cut short, listed twice, copied, missing, a folder, and damaged alike, which makes no repeats of each other."""
    folder = copied(tmp_path / "campaign")
    whole = (folder / "sweep-2.uff").read_bytes()
    (folder / "sweep-2.uff").write_bytes(whole[: len(whole) * 3 // 5])
    shutil.copy(folder / "sweep-1.uff", folder / "sweep-4.uff")
    text = (folder / "campaign.toml").read_text(encoding="utf-8")
    text = text.replace('"ramps-5hz-100-3.mat"', '"ramps-5hz-100-3.mat", "ramps-5hz-100-1.mat"')
    (folder / "campaign.toml").write_text(text, encoding="utf-8")
    (folder / MAT).unlink()
    for file in ("loops-1.txt", "loops-3.txt"):
        (folder / file).write_bytes(b"")
    (folder / "loops-2.txt").unlink()
    (folder / "loops-2.txt").mkdir()
    truncated, *others = sorted(said(folder), key=lambda one: "truncated" not in one)
    assert truncated.startswith("sweep-2.uff")
    assert set(others) == {
        "sweep-4.uff: holds the same record as sweep-1.uff: it is no repeat, and sweep-1.uff alone counts",
        "ramps-5hz-100-1.mat (again): is listed twice: it counts once",
        f"{MAT}: is missing: there is no such file",
        "loops-1.txt: is empty",
        "loops-2.txt: is a folder",
        "loops-3.txt: is empty",
    }


def test_where_no_step_is_done_what_was_excluded_is_told(tmp_path):
    folder = copied(tmp_path / "campaign")
    files = [file for file in folder.iterdir() if file.is_file() and file.suffix != ".toml"]
    for file in files:
        file.write_bytes(b"")
    with pytest.raises(InputError) as error:
        identify(folder)
    assert any(one.startswith("excluded: ") and one.endswith(": is empty") for one in error.value.problems)
    for file in files:
        file.unlink()
    with pytest.raises(InputError, match=r"records: none of the files that it names is there: there is no file"):
        read_campaign(folder)


def test_records_that_are_sampled_otherwise_than_most_are_left_out(tmp_path):
    folder, file = copied(tmp_path / "campaign", "ramps"), "ramps-60hz-100.mat"
    changed(folder, lambda c: c.update({k: v[::2] for k, v in c.items() if np.size(v) > 1}, fs=0.5 * c["fs"]), file)
    chain = grounded(read_campaign(folder))
    for _ in range(2):  # as steps are done again
        kept = chain.alike(Purpose.RAMPS)
    assert kept and file not in {one.file for one in kept}
    told = [one for one in map(str, chain.evidence.left_out) if "is sampled at" in one]
    assert len(told) == 1 and told[0].startswith(f"{file}: is sampled at 10 kHz, most records of its purpose at 20")


def test_too_few_bounces_are_counted(tmp_path):
    folder = copied(tmp_path / "campaign", "ramps", "bounces")
    for file in folder.glob("bounces-*.h5"):
        with h5py.File(file, "a") as content:
            for name in [key for key in content if content[key].shape]:
                values, attrs = content[name][:270], dict(content[name].attrs)
                del content[name]
                content.create_dataset(name, data=values).attrs.update(attrs)
    chain = grounded(read_campaign(folder))
    traces = next(found for purpose, found in chain.evidence.traces.items() if purpose.value == "bounces")
    with pytest.raises(InputError, match=r"2 records of bounces: channel 'tip' shows \d bounces .* at least 3"):
        identify_restitution(chain.opened.model, chain.known, traces, chain.evidence.level, 1)


def test_a_record_that_ends_before_its_drive_does_is_told():
    opened = read_campaign(folder_of_all())
    record = read_records(opened, "loops")[0].record
    assert record is not None
    for share, cut in ((0.95, False), (0.6, True)):
        part = replace(record, values=record.values[:, : int(share * record.count)])
        told, _ = checked_drive(part, opened.campaign.records["loops"])
        assert bool(told) is cut
    assert list(map(str, told)) == [
        "loops-1.txt, channel 'pzt volts': the record ends 1.76 s after the drive begins, and the drive that the "
        "campaign states takes 2.571 s: is the file cut short?"
    ]


def sweeps() -> tuple[StepRunner, list[Measurement]]:
    chain = StepRunner.of(read_campaign(folder_of_all()))
    read = [one for name, _ in chain.opened.sets(Purpose.MODAL) for one in read_records(chain.opened, name)]
    return chain, [one.record for one in read if one.record is not None]


@pytest.mark.parametrize("digits", [0.0, 2e-4], ids=["as recorded", "rounded"])
def test_a_fast_velocity_that_is_clipped_is_told_by_its_extremes(digits):
    _, (record, *_) = sweeps()
    most = float(np.max(np.abs(record["tip velocity"])))
    step = digits * most
    values = np.round(record.values / step) * step if step else record.values
    assert not replace(record, values=values).clipped()
    clipped = values.copy()
    clipped[record.index("tip velocity")] = np.clip(values[record.index("tip velocity")], -np.inf, 0.7 * most)
    (told,) = replace(record, values=clipped).clipped()
    assert told.startswith("channel 'tip velocity' is clipped: ") and "have the same extreme value" in told


def test_crests_that_are_rounded_and_repeat_are_not_clipped():
    time = np.arange(20000) / 20e3
    wave = np.sin(2.0 * np.pi * 200.0 * time)
    flat = wave * (1.5 - 0.5 * wave**2)
    for values in (wave, np.round(wave, 2), np.round(wave, 4), np.round(flat, 3), np.sign(wave)):
        record = Measurement((Channel("tip", Quantity.VELOCITY),), values[None], 5e-5)
        assert not record.clipped()


def row(record: Measurement, name: str, factor: float) -> Measurement:
    values = record.values.copy()
    values[record.index(name)] *= factor
    return replace(record, values=values)


def shorter(record: Measurement) -> Measurement:
    return replace(record, values=record.values[:, : record.count * 3 // 4])


def slower(record: Measurement) -> Measurement:
    """The same drive on a softer device."""
    moved = np.array([np.roll(record[name], 40) * 0.7 for name in record.names])
    moved[record.index("pzt volts")] = record["pzt volts"]
    return replace(record, values=moved)


def swapped(record: Measurement) -> Measurement:
    tip, center = record.index("tip velocity"), record.index("center velocity")
    order = list(range(len(record.channels)))
    order[tip], order[center] = center, tip
    return replace(record, values=record.values[order])


@pytest.mark.parametrize(
    ("change", "channel", "words"),
    [
        (shorter, "", "it has 27000 samples at 20000 Hz, most sweeps 36000"),
        (lambda r: row(r, "tip velocity", 1e3), "tip velocity", "it is 1e+03 times what the other sweeps show"),
        (lambda r: row(r, "tip velocity", -1.0), "tip velocity", "it is -1 times"),
        (lambda r: row(r, "pzt volts", 0.5), "pzt volts", "all responses are 2 times"),
        (lambda r: row(r, "center velocity", 0.0), "center velocity", "it does not respond"),
        (swapped, "", "channels 'tip velocity' and 'center velocity' look swapped"),
        (slower, "", "its responses are not those of the other sweeps"),
    ],
)
def test_one_sweep_unlike_the_others_is_left_out(change, channel, words):
    chain, records = sweeps()
    records[0] = change(records[0])
    found = agreeing(records, chain.opened.model.points, (300.0, 8900.0))
    assert found.records == tuple(records[1:])
    (out,) = found.left_out
    assert (out.file, out.channel) == ("sweep-1.uff", channel) and words in out.reason


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (swapped, r"sweep-1.uff.*channels 'center' and 'tip' look swapped|'tip' and 'center'"),
        (lambda r: row(r, "tip velocity", -1.0), r"the sign of channel '(tip|center)' looks flipped"),
    ],
)
def test_what_is_wrong_in_all_sweeps_is_told_by_the_modes(change, said):
    chain, records = sweeps()
    with pytest.raises(InputError, match=said):
        identify_resonances(chain.opened.model, [change(one) for one in records], (200.0, 8900.0), 1)


# Slow: the modes of three sweeps. That the odd one is excluded, with its reason, is tested above.
@pytest.mark.slow
def test_the_chain_goes_on_without_a_sweep_unlike_the_others():
    chain, records = sweeps()
    records[2] = row(records[2], "tip velocity", 1e3)
    step = identify_resonances(chain.opened.model, records, (200.0, 8900.0), 1).step
    true = truth().robot.structure
    assert isinstance(true, Beam)
    assert step.values[:2] == pytest.approx(true.frequencies, rel=1e-4)
    assert str(step.used[0]) == "3 of 4 sweeps" and [one.file for one in step.left_out] == ["sweep-3.uff"]


def test_sweeps_of_which_no_majority_agrees_are_refused():
    chain, records = sweeps()
    records[:2] = [slower(one) for one in records[:2]]
    with pytest.raises(InputError, match="show different responses, and no more than half of them agree"):
        agreeing(records, chain.opened.model.points, (300.0, 8900.0))
    records[:2] = [shorter(one) for one in records[:2]]
    with pytest.raises(InputError, match="have different lengths or sampling rates"):
        agreeing(records, chain.opened.model.points, (300.0, 8900.0))


def test_sweeps_of_unlike_lengths_are_told_before_anything_is_identified(tmp_path):
    folder = copied(tmp_path / "campaign", "modal")
    assert not readiness_of(read_campaign(folder)).problems
    for number, record in enumerate(sweeps()[1][:2], start=1):
        write_uff(shorter(record), folder / f"sweep-{number}.uff")
    told = [one for one in readiness_of(read_campaign(folder)).problems if "lengths" in one]
    assert len(told) == 1 and told[0].endswith("no more than half of them agree: repeat one of them")


def test_a_campaign_file_tells_all_its_faults_at_once_and_those_of_the_device_name_its_file(tmp_path):
    folder = copied(tmp_path / "campaign")
    file = folder / "campaign.toml"
    whole = file.read_text(encoding="utf-8")
    text = whole.replace('foot = "tip"', 'foot = "tipp"').replace('point = "center"', 'point = "centre"', 1)

    def problems(text: str) -> list[str]:
        file.write_text(text, encoding="utf-8")
        with pytest.raises(InputError) as caught:
            read_campaign(folder)
        return caught.value.problems

    assert problems(text) == [
        "campaign.toml: foot: the device has no foot 'tipp'; did you mean 'tip'?",
        "campaign.toml: records.sweep-1.channels.2+Z.point: the structure has no point 'centre'; did you "
        "mean 'center'?",
    ]
    assert all(one.startswith("campaign.toml: ") for one in problems("records = 3\n"))
    assert problems(text.replace('files = ["sweep-3.uff"]', "files = []")) == [
        "campaign.toml: records.sweep-3.files: expected at least one file, got none"
    ]
    device = (folder / "device.toml").read_text(encoding="utf-8")
    (folder / "device.toml").write_text(device.replace("[robot.feet.tip]", "[robot.feet.tip]\nheight = 3"))
    assert problems(whole)[0].startswith("device.toml: robot.feet.tip.height: unknown name")
