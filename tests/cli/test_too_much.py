"""Input that is too large, too deep, endless or of another kind, and streams and disks that take nothing more."""

from __future__ import annotations

import os
import resource
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import tarsus as ts
from tarsus.base.errors import InputError
from tarsus.files import tables
from tarsus.files.whole import written_whole
from tarsus.records.measurement import Channel, Measurement, Quantity
from tarsus.synthesis import record_files

NESTED = "[" * 5000 + "]" * 5000


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (f"name = {NESTED}\n", "lists or tables are nested more than 50 deep"),
        (f"{'a.' * 3000}a = 1\n", "lists or tables are nested more than 50 deep"),
        (f"name = {'1' * 5000}\n", "holds a whole number of more than 4300 digits"),
        ("".join(f"k{i} = 1\n" for i in range(100_001)), "assigns more than 100000 names"),
    ],
)
def test_a_file_that_is_too_much(tarsus, tmp_path, text, said):
    file = tmp_path / "much.toml"
    file.write_text(text)
    for verb in ("check", "simulate", "sweep", "identify"):
        refused = tarsus(verb, file, *(["-o", tmp_path / "out"] if verb != "check" else []))
        (sentence,) = refused.sentences
        assert refused.code == 2 and said in sentence and len(sentence) < 300


def test_of_very_many_faults_some_are_named_and_the_rest_counted(tarsus, tmp_path):
    file = tmp_path / "many.toml"
    file.write_text("".join(f"k{i} = 1\n" for i in range(5000)))
    sentences = tarsus("check", file).sentences
    assert len(sentences) == 101 and sentences[3].startswith("k0: unknown name 'k0'")
    assert sentences[-1] == "4903 more problems are not listed"  # name, robot and duration are missing as well


@pytest.mark.parametrize("setting", ["1" * 5000, NESTED])
def test_a_setting_that_is_too_much(tarsus, setting):
    (sentence,) = tarsus("simulate", "cantilever", "--set", f"robot.feet.tip.gap={setting}").sentences
    assert sentence.startswith("--set robot.feet.tip.gap: ") and len(sentence) < 200


def test_a_file_without_an_end(tarsus, tmp_path):
    for words in (["simulate", "-o", tmp_path / "out"], ["reproduce", "cantilever", "--rows"]):
        refused = tarsus(*words, "/dev/zero")
        assert refused.code == 2 and "/dev/zero: is larger than the 16 MiB" in refused.sentences[0]
    for verb in ("show", "check"):
        (sentence,) = tarsus(verb, "/dev/zero").sentences
        assert "is a device, not a file" in sentence


def test_a_byte_order_mark_is_no_fault(tmp_path):
    file = tmp_path / "scene.toml"
    ts.write_scene(ts.load_scene("cantilever"), file)
    file.write_bytes(b"\xef\xbb\xbf" + file.read_bytes())
    assert ts.read_scene(file) == ts.load_scene("cantilever")
    assert tables.table_of("\ufeffa = 1", "text") == {"a": 1}


@pytest.mark.parametrize("closed", [pytest.param("<&- >&-", marks=pytest.mark.slow), ">&- 2>&-"])
def test_closed_streams_are_no_fault(closed):
    done = subprocess.run(
        ["sh", "-c", f'"$0" -m tarsus devices {closed}', sys.executable], capture_output=True, timeout=60
    )
    assert (done.returncode, done.stdout, done.stderr) == (0, b"", b"")


@pytest.mark.slow
def test_who_reads_only_the_first_fault_gets_no_other(tmp_path):
    file = tmp_path / "many.toml"
    file.write_text("".join(f"{'k' * 200}{i} = 1\n" for i in range(600)))  # more than a pipe holds
    read, write = os.pipe()
    with subprocess.Popen([sys.executable, "-m", "tarsus", "check", file], stdout=write, stderr=write) as run:
        os.close(write)
        assert os.read(read, 8) == b"tarsus: "
        os.close(read)
        assert run.wait(60) == 2


@pytest.fixture
def small_disk():
    """Files may not grow beyond 20 kB, as on a disk that fills up."""
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (20_000, before[1]))
    yield
    resource.setrlimit(resource.RLIMIT_FSIZE, before)


@pytest.mark.parametrize("kind", ["uff", "mat", "hdf", "polytec", "csv"])
def test_a_record_is_whole_or_not_there(tmp_path, small_disk, kind):
    values = np.random.default_rng(1).normal(size=(1, 20_000))
    record = Measurement((Channel("tip", Quantity.DISPLACEMENT),), values, 1e-4)
    with pytest.raises(InputError, match=rf"cannot write {tmp_path}/record\.x: file too large$"):
        getattr(record_files, f"write_{kind}")(record, tmp_path / "record.x")
    assert not list(tmp_path.iterdir())


def test_a_picture_is_whole_or_not_there(tmp_path, small_disk):
    from PIL import Image

    noise = np.random.default_rng(1).integers(0, 255, (300, 300, 3), dtype=np.uint8)
    file = tmp_path / "walk.gif"
    file.write_bytes(b"before")
    with pytest.raises(InputError, match=r"cannot write .*walk\.gif: file too large$"), written_whole(file) as part:
        Image.fromarray(noise).save(part)
    with pytest.raises(ZeroDivisionError), written_whole(tmp_path / "a") as part:
        Path(part).write_text("half")
        _ = 1 / 0
    assert [one.name for one in tmp_path.iterdir()] == ["walk.gif"] and file.read_bytes() == b"before"
