"""One grammar for all verbs: the same words mean the same, and a command line says as much as it is asked to."""

from __future__ import annotations

from collections import defaultdict

import pytest

from tarsus.cli import app


@pytest.fixture(scope="module")
def options():
    """Help of every option by verb: {"--set": {"simulate": "path=value ..."}}."""
    found: dict[str, dict[str, str]] = defaultdict(dict)

    def look(one, verb):
        for name in one:
            if not name.startswith("-"):
                look(one[name], f"{verb} {name}".strip())
        if one.default_command is not None:
            for argument in one.assemble_argument_collection():
                for word in argument.names:
                    found[word][verb] = argument.parameter.help or ""

    look(app.build([]), "")
    return found


@pytest.mark.parametrize(
    "word",
    ["--set", "--law", "--json", "--overwrite", "--threads", "--dask", "--duration", "--resume", "--report"],
)
def test_a_word_means_the_same_in_every_verb(options, word):
    said = {verb: text for verb, text in options[word].items() if verb not in ("sweep", "reproduce")}
    assert len(said) >= 2 and len(set(said.values())) == 1, said


def test_every_verb_speaks_json(options):
    silent = {"completion"}  # which prints a script
    verbs = {verb for said in options.values() for verb in said} - {"", "design"}
    assert verbs - set(options["--json"]) == silent


def test_every_verb_that_draws_at_random_takes_a_seed(options):
    drawing = {
        "calibrate", "design adapt", "design gait", "design landing", "identify", "recommend", "reproduce", "sweep",
        "synthesize", "yield",
    }  # fmt: skip
    assert set(options["--seed"]) == drawing


def test_every_verb_that_makes_many_runs_takes_threads(options):
    many = {"calibrate", "design adapt", "design gait", "design landing", "recommend", "sweep", "yield"}
    assert set(options["--threads"]) >= many and set(options["--dask"]) >= many


def test_every_verb_that_writes_a_folder_takes_overwrite(options):
    assert set(options["-o"]) == set(options["--output"]) == set(options["--overwrite"])


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
    import tarsus.files.library as library

    def broken():
        raise RuntimeError("the cat sat on it")

    monkeypatch.setattr(library, "device_names", broken)
    assert app.run(["devices", "-v"]) == 1
    said = capsys.readouterr().err
    assert "Traceback" in said and said.splitlines()[-1].startswith("tarsus: something went wrong")


def test_less_and_more_at_once_is_refused(tarsus):
    said = tarsus("-q", "devices", "-v")
    assert said.code == 2 and said.out == "" and "one of them" in said.sentences[0]


def test_a_former_name_of_a_verb_works_and_says_so(tarsus):
    said = tarsus("next", "cantilever", "--parameter", "ground.film.height", "--budget", "1 s")
    assert said.sentences[0] == "note: `tarsus next` is now `tarsus recommend`; the former name will go"
    assert said.code == 2 and "ground.film.height" in said.sentences[1]


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
