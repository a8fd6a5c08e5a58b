"""One grammar for all verbs: the same words mean the same, and a command line says as much as it is asked to."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from cli_options import options_by_verb
from tarsus.cli import app, former

OPTIONS = options_by_verb()
SAME = (
    "--set",
    "--law",
    "--seed",
    "--threads",
    "--on",
    "--overwrite",
    "--resume",
    "--report",
    "--json",
    "--duration",
)
"""Words that mean the same wherever they stand."""


@pytest.mark.parametrize("word", SAME)
def test_a_word_means_the_same_in_every_verb(word):
    said = [words[word] for words in OPTIONS.values() if word in words]
    assert len(said) >= 2 and len(set(said)) == 1


@pytest.mark.parametrize("verb", OPTIONS)
def test_words_come_with_those_that_belong_to_them(verb):
    words = OPTIONS[verb]
    assert ("--json" in words) != (verb in ("completion", "design request"))  # which print a file
    assert ("--output" in words) == ("--overwrite" in words) >= ("--resume" in words)
    assert ("--law" in words) >= ("--set" in words)
    assert ("--threads" in words) == ("--on" in words) or verb in ("reproduce", "attractors", "branch", "validate")
    assert all(words.values()), "every word is explained"


def test_the_page_of_the_command_line_names_every_verb_and_its_words():
    page = (Path(__file__).parents[2] / "docs" / "cli.md").read_text(encoding="utf-8")
    for verb, words in OPTIONS.items():
        line = " ".join(
            one
            for one in re.findall(r"^`(tarsus .*)`$", page, re.MULTILINE)
            if f"{one} ".startswith(f"tarsus {verb} ")
        )
        for word in ("-o", "--seed", "--threads", "--resume", "--json"):
            assert (word in line) == (word in words), f"{verb}: {word}"
        for word in re.findall(r"--[a-z-]+", line.replace("--no-", "--")):
            assert word in words, f"{verb}: {word}"


def test_quiet_leaves_results_and_errors(tarsus):
    words = ("simulate", "cantilever", "--duration", "1 ms", "--set", "robot.feet.tip.gap=70")
    usual, quiet = tarsus(*words), tarsus(*words, "-q")
    assert any("is far" in one for one in usual.sentences) and quiet.err == "" and quiet.code == 0
    first = [line for line in usual.out.splitlines() if "energy" in line]
    assert first and first == [line for line in quiet.out.splitlines() if "energy" in line]
    assert tarsus("--quiet", "show", "nowhere").sentences


def test_quiet_names_no_files(tarsus, tmp_path):
    words = ("simulate", "cantilever", "--duration", "1 ms", "--no-report", "-o")
    assert "wrote" in tarsus(*words, tmp_path / "a").out
    assert "wrote" not in tarsus(*words, tmp_path / "b", "-q").out and (tmp_path / "b" / "series.nc").exists()


def test_verbose_says_what_ran_and_what_it_took(tarsus):
    said = tarsus("-v", "simulate", "cantilever", "--duration", "1 ms").sentences
    assert said[0] == "cantilever: coordinates 2, drives 1, feet 1, 0.2 s; values set 0"
    assert "s of CPU" in said[-1]


def test_verbose_shows_where_a_defect_is(monkeypatch, capsys):
    from tarsus.inspection import installation

    def broken():
        raise RuntimeError("the cat sat on it")

    monkeypatch.setattr(installation, "device_names", broken)
    assert app.run(["devices", "-v"]) == 1
    said = capsys.readouterr().err
    assert "Traceback" in said and said.splitlines()[-1].startswith("tarsus: something went wrong")


def test_less_and_more_at_once_is_refused(tarsus):
    said = tarsus("-q", "devices", "-v")
    assert said.code == 2 and said.out == "" and "one of them" in said.sentences[0]


@pytest.mark.parametrize(
    ("words", "now"),
    [
        *((name, now) for name, now in former.COMMANDS.items()),
        *former.OPTIONS.items(),
    ],
)
def test_a_former_word_is_answered_with_the_present_one(tarsus, words, now):
    said = tarsus(*words.split(), "x")
    (sentence,) = said.sentences
    assert (said.code, said.out) == (2, "")
    assert words.split()[-1] in sentence and sentence.endswith(f" is gone: use {now}")
