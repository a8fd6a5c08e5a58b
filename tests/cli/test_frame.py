"""Help, unknown words, interruption and closed pipes."""

from __future__ import annotations

import signal
import subprocess
import sys
import time
from importlib.metadata import version

import pytest

from tarsus.cli import app
from tarsus.inspection import installation

VERBS = sorted([*app.VERBS, "reproduce"])


HEAVY = ("numpy", "scipy", "numba", "pydantic", "matplotlib", "xarray", "h5py")


LIGHT = f"""
import sys
from tarsus.cli import main
for words in {[["--help"], ["--version"], *([verb, "--help"] for verb in VERBS)]!r}:
    sys.argv = ["tarsus", *words]
    try:
        main()
    except SystemExit:
        pass
    print("loaded by", *words, *(name for name in {HEAVY!r} if name in sys.modules))
"""


def test_help_loads_nothing_heavy():
    """What makes help quick: the time itself is the benchmark's to measure."""
    done = subprocess.run([sys.executable, "-c", LIGHT], capture_output=True, text=True, check=True)
    loaded = [line for line in done.stdout.splitlines() if line.startswith("loaded by ")]
    assert loaded == ["loaded by --help", "loaded by --version", *(f"loaded by {verb} --help" for verb in VERBS)]


def test_the_front_page_says_what_the_pages_of_the_verbs_say(tarsus):
    """It is read from the files of the verbs, which their own pages are made from by import."""
    front = " ".join(tarsus("--help").out.split())
    assert tarsus().out.split() == tarsus("-h").out.split() == front.split()
    for verb in VERBS:
        purpose = tarsus(verb, "--help").out.strip().split("\n\n")[1]
        assert f" {verb} {' '.join(purpose.split())} " in front
    assert tarsus("--version").out.strip() == version("tarsus")


def answered() -> TypeError:
    """An interrupt as numpy passes it on."""
    error = TypeError("cannot compare")
    error.__cause__ = KeyboardInterrupt()
    return error


@pytest.mark.parametrize(
    ("error", "code", "said"),
    [
        (KeyboardInterrupt(), 130, "interrupted"),
        (answered(), 130, "interrupted"),
        (MemoryError(), 1, "not enough memory"),
        (RuntimeError("the cat sat on it"), 1, ": RuntimeError: the cat sat on it; unless that file is yours"),
    ],
)
def test_what_goes_wrong_ends_in_a_sentence(tarsus, monkeypatch, error, code, said):
    def fails():
        raise error

    monkeypatch.setattr(installation, "device_names", fails)
    result = tarsus("devices")
    assert result.code == code and said in result.sentences[0]


@pytest.mark.slow
def test_a_long_run_hears_an_interrupt():
    """In one call of the engine, which would take minutes."""
    words = [sys.executable, "-m", "tarsus", "simulate", "millipede-30", "--duration", "300 s", "-v"]
    hears = "import signal, os, sys; signal.signal(2, signal.default_int_handler); os.execv(sys.argv[1], sys.argv[1:])"
    run = subprocess.Popen([sys.executable, "-c", hears, *words], stderr=subprocess.PIPE, text=True)
    assert run.stderr is not None and "millipede-30" in run.stderr.readline()
    time.sleep(1.0)
    run.send_signal(signal.SIGINT)
    assert "tarsus: interrupted" in run.communicate(timeout=60)[1]
    assert run.returncode == 130


HELD = """
import os, signal, sys, time
from importlib import import_module
from tarsus.cli import main
module, name, *words = sys.argv[1:]
module, begun = import_module(module), []
whole = getattr(module, name)
def held(*given):
    begun.append(1)
    found = whole(*given)
    if len(begun) > 2:
        os.write(1, b"under way\\n")  # at once: other threads say it too
        time.sleep(600)
    return found
setattr(module, name, held)
signal.signal(signal.SIGINT, signal.default_int_handler)
main(words)
"""
"""A command line whose third part takes for ever."""

MAP = "--x robot.feet.tip.gap=50um:80um --y volts=4:10 --depth 4 --coarse 4 --threads 2"


@pytest.mark.slow
@pytest.mark.parametrize(
    ("parts", "words"),
    [
        ("tarsus.study.sweeping work_unit", "sweep cantilever-adhesion"),
        ("tarsus.atlas.cells _cells", f"atlas cantilever {MAP}"),
    ],
)
def test_a_second_interrupt_ends_work_now_and_loses_nothing_finished(tmp_path, parts, words):
    words = [*words.split(), "-o", str(tmp_path / "out")]
    run = subprocess.Popen(
        [sys.executable, "-c", HELD, *parts.split(), *words], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    )
    assert run.stdout is not None and run.stderr is not None and run.stdout.readline() == "under way\n"
    time.sleep(1.0)
    run.send_signal(signal.SIGINT)
    said = next(line for line in run.stderr if "under way" in line)
    assert said.endswith("Ctrl-C again ends it now, and finished parts are kept\n")
    kept = set((tmp_path / "out").glob("units/*/*.npz"))
    run.send_signal(signal.SIGINT)
    assert run.communicate(timeout=20)[1].endswith("--resume`\n") and run.returncode == 130
    after = set((tmp_path / "out").glob("units/*/*.npz"))  # a part that was under way may have been finished since
    assert after and kept <= after


@pytest.mark.slow
@pytest.mark.parametrize("words", ["show cantilever --json", "simulate --help"])
def test_a_reader_that_stops_reading_is_no_error(words):
    code = "import os, sys; sys.stdin.close(); os._exit(0)"
    show = subprocess.Popen(
        [sys.executable, "-m", "tarsus", *words.split()], stdout=subprocess.PIPE, stderr=subprocess.PIPE
    )
    reader = subprocess.Popen([sys.executable, "-c", code], stdin=show.stdout)
    assert show.stdout is not None and show.stderr is not None
    show.stdout.close()
    reader.wait(timeout=60)
    said = show.stderr.read().decode()
    assert show.wait(timeout=60) == 0
    assert said == ""


@pytest.mark.parametrize(
    ("more", "said"), [((), "interrupted, nothing further was written"), (("-o", "out"), "--resume`")]
)
def test_parts_are_said_to_be_kept_where_a_folder_keeps_them(tarsus, monkeypatch, tmp_path, more, said):
    def interrupted(*words, **options):
        raise KeyboardInterrupt

    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("tarsus.atlas.verb.atlas", interrupted)
    assert tarsus("atlas", "cantilever-gap-map", *more).sentences[-1].endswith(said)
