"""One grammar for all verbs: the same words mean the same, and a command line says as much as it is asked to."""

from __future__ import annotations

import re
from collections import defaultdict
from pathlib import Path

import pytest

from tarsus.cli import app, former


@pytest.fixture(scope="module")
def options():
    """Help of every option by verb: {"--set": {"simulate": "path=value ..."}}."""
    found: dict[str, dict[str, str]] = defaultdict(dict)

    def look(one, verb):
        for name in one:
            if not name.startswith("-"):
                look(one[name], f"{verb} {name}".strip())
        if one.default_command is not None:
            for argument in one.assemble_argument_collection(parse_docstring=True):
                for word in argument.names:
                    found[word][verb] = argument.parameter.help or ""

    look(app.build([]), "")
    return found


WORDS = {
    "a scene": ("--set", "--law"),
    "laws": ("--law",),
    "draws": ("--seed",),
    "many runs": ("--threads", "--on"),
    "threads": ("--threads",),
    "files": ("-o", "--output", "--overwrite"),
    "a page": ("-o", "--output", "--overwrite", "--report"),
    "goes on": ("--resume",),
    "a time": ("--duration",),
}
"""The words that a verb must take for what it does, beside --json."""

VERBS = {
    "devices": (), "show": ("laws",), "new": (), "check": ("laws",), "report": ("laws",), "bench": (), "doctor": (),
    "completion": (),
    "simulate": ("a scene", "a page", "a time"),
    "plot": ("laws", "files"),
    "movie": ("a scene", "files", "a time"),
    "branch": ("a scene", "a page"),
    "sweep": ("laws", "draws", "many runs", "a page", "goes on"),
    "yield": ("a scene", "draws", "many runs", "files", "goes on"),
    "synthesize": ("a scene", "draws", "files"),
    "identify": ("draws", "a page"),
    "calibrate": ("laws", "draws", "many runs", "a page", "goes on"),
    "recommend": ("a scene", "draws", "many runs"),
    "design landing": ("a scene", "many runs", "a page"),
    "design gait": ("a scene", "many runs", "a page", "goes on"),
    "design adapt": ("a scene", "many runs", "a page"),
    "design request": (),
    "reproduce": ("draws", "threads", "files", "goes on"),
}  # fmt: skip
"""What each verb does. A new verb is added here."""


def test_every_verb_is_listed(options):
    assert {verb for said in options.values() for verb in said} - {"", "design"} == set(VERBS)


@pytest.mark.parametrize("verb", VERBS)
def test_a_verb_takes_the_words_of_what_it_does_and_no_other(options, verb):
    own = {word for does in VERBS[verb] for word in WORDS[does]}
    own |= {"--json"} if verb not in ("completion", "design request") else set()  # which print a file
    shared = {word for words in WORDS.values() for word in words} | {"--json"}
    assert {word for word in shared if verb in options[word]} == own


@pytest.mark.parametrize(
    "word", sorted({word for words in WORDS.values() for word in words} - {"-o", "--output"})
)
def test_a_word_means_the_same_in_every_verb(options, word):
    assert len(options[word]) >= 2 and len(set(options[word].values())) == 1, options[word]


def test_every_word_is_explained(options):
    silent = {(verb, word) for word, said in options.items() for verb, text in said.items() if not text}
    assert {(verb, word) for verb, word in silent if word != "*"} == set()


def test_the_page_of_the_command_line_names_every_verb_and_its_words(options):
    page = (Path(__file__).parents[2] / "docs" / "cli.md").read_text(encoding="utf-8")
    for verb in VERBS:
        line = " ".join(
            one
            for one in re.findall(r"^`(tarsus .*)`$", page, re.MULTILINE)
            if f"{one} ".startswith(f"tarsus {verb} ")
        )
        for word in ("-o", "--seed", "--threads", "--resume", "--json"):
            assert (word in line) == (verb in options[word]), f"{verb}: {word}"
        for word in re.findall(r"--[a-z-]+", line.replace("--no-", "--")):
            assert verb in options[word], f"{verb}: {word}"


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
        *((name if " " in name else f"calibrate {name}", now) for name, now in former.OPTIONS.items()),
    ],
)
def test_a_former_word_is_answered_with_the_present_one(tarsus, words, now):
    said = tarsus(*words.split(), "x")
    (sentence,) = said.sentences
    assert (said.code, said.out) == (2, "")
    assert words.split()[-1] in sentence and sentence.endswith(f" is gone: use {now}")


def test_threads_are_a_number_of_one_or_more(tarsus):
    said = tarsus(
        "recommend",
        "cantilever",
        "--parameter",
        "ground.film.coefficient",
        "--budget",
        "1 s",
        "--threads",
        "0",
    )
    assert said.code == 2 and "--threads: expected a number of 1 or more, got 0" in said.sentences[0]
