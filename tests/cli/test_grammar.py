"""One grammar for all verbs: the same words mean the same, and a command line says as much as it is asked to."""

from __future__ import annotations

import contextlib
import importlib
import inspect
import re
from pathlib import Path
from typing import Any

import pytest

import tarsus as package
from tarsus.cli import app, asked, former
from tarsus.cli.declared import NO_DEFAULT
from tarsus.cli.verbs import COMMANDS
from tarsus.files.kinds import MARKS


def options_by_verb() -> dict[str, dict[str, str]]:
    """Of an option with a short name, both names."""
    found: dict[str, dict[str, str]] = {}

    def look(one: Any, verb: str) -> None:
        for name in one:
            if not name.startswith("-"):
                look(one[name], f"{verb} {name}".strip())
        if one.default_command is not None:
            arguments = one.assemble_argument_collection(parse_docstring=True)
            words = {word: argument.parameter.help or "" for argument in arguments for word in argument.names}
            found[verb] = {word: said for word, said in words.items() if word.startswith("-")}

    look(app.build([]), "")
    return found


OPTIONS = options_by_verb()
"""Options of every command with their help: {"simulate": {"--set": "path=value ..."}}."""
SAME = ("--set", "--law", "--seed", "--threads", "--on", "--overwrite", "--resume", "--report", "--json")
"""Words that mean the same wherever they stand."""


@pytest.mark.parametrize("word", SAME)
def test_a_word_means_the_same_in_every_verb(word):
    said = [words[word] for words in OPTIONS.values() if word in words]
    assert len(said) >= 2 and len(set(said)) == 1


@pytest.mark.parametrize("verb", [verb for verb, words in OPTIONS.items() if "--resume" in words])
def test_where_a_verb_keeps_its_runs_is_the_output_of_its_function(verb):
    assert "output" in inspect.signature(function_of(verb)).parameters


@pytest.mark.parametrize("verb", OPTIONS)
def test_words_come_with_those_that_belong_to_them(verb):
    words = OPTIONS[verb]
    assert ("--json" in words) != (verb in ("completion", "design request"))  # which print a file
    assert ("--output" in words) == ("--overwrite" in words) >= ("--resume" in words)
    assert ("--report" in words) or "--resume" not in words
    assert ("--law" in words) >= ("--set" in words)
    assert ("--threads" in words) == ("--on" in words) or verb in ("reproduce", "attractors", "branch", "validate")
    assert all(words.values()), "every word is explained"


def test_the_page_of_the_command_line_names_every_verb_and_its_words():
    page = (Path(__file__).parents[2] / "docs" / "cli.md").read_text(encoding="utf-8")
    printed = re.findall(r"`(tarsus [^`]*)`", page.split("## Verbs")[1])
    for verb, words in OPTIONS.items():
        longer = tuple(f"tarsus {one} " for one in OPTIONS if one.startswith(f"{verb} "))
        own = [one for one in printed if f"{one} ".startswith(f"tarsus {verb} ")]
        lines = [one for one in own if not one.startswith(longer)]
        assert lines, verb
        for word in re.findall(r"--[a-z-]+", " ".join(lines).replace("--no-", "--")):
            assert word in words, f"{verb}: {word}"


LINES = [
    ("branch cantilever --along volts=8V:7.5V --starts 0", {"along": {"volts": ("8V", "7.5V")}, "starts": 0}),
    ("attractors millipede --over height=0:5um --no-edges", {"over": {"height": ("0", "5um")}, "edges": False}),
    ("atlas cantilever --x volts=4V:8V -o out", {"x": ("volts", "4V", "8V"), "output": Path("out")}),
    ("atlas cantilever --y hz=5:50:log -o out", {"y": ("hz", "5", "50", "log"), "resume": False}),
    ("yield millipede --dead 0:2 --weakness 60%", {"dead": (0, 2), "weak": (0, 0), "weakness": "60%"}),
    ("yield millipede --over hz=1:2 --robots 8", {"over": {"hz": ("1", "2")}, "robots": 8, "draws": 0}),
    ("yield millipede --require peak --require slip=3", {"require": {"peak": None, "slip": "3"}}),
    ("yield millipede", {"scatter": None, "output": Path("millipede.yield"), "seed": 0, "starts": None}),
    ("modes a.uff b.uff --band 1Hz:2Hz --read Ch1=m/s", {"band": ("1Hz", "2Hz"), "read": {"Ch1": "m/s"}}),
    ("recommend cantilever --budget 2s --vary hz=5,15", {"budget": "2s", "vary": {"hz": "5,15"}}),
    ("sweep gaps.toml --array 3 --sbatch=-p", {"array": 3, "sbatch": "-p", "output": Path("gaps.sweep")}),
    ("calibrate cantilever --seed 3", {"output": Path("cantilever.calibration"), "seed": 3}),
    ("identify lab --track june july", {"campaign": Path("lab"), "track": [Path("june"), Path("july")]}),
    ("export cantilever --to c --step=10ns -o out", {"to": "c", "step": "10ns", "output": Path("out")}),
    ("report out --draw a.csv --branch 8 --no-browser", {"draw": ["a.csv"], "branch": 8}),
    ("show a.csv --read Ch1=V --read record=2", {"name": "a.csv", "read": {"Ch1": "V", "record": "2"}}),
    ("new device mine.toml --legs 4", {"kind": "device", "path": Path("mine.toml"), "legs": 4}),
    ("plot out gap -o gap.svg --only tip", {"name": "gap", "only": ["tip"], "output": Path("gap.svg")}),
    ("synthesize cantilever-capture -o lab --perturb 0.2", {"perturb": "0.2", "rate": "20 kHz", "seed": 1}),
    ("validate --all", {"name": None, "threads": None}),
]


@pytest.mark.parametrize("verb", [verb for verb, one in COMMANDS.items() if one.files and verb != "export"])
def test_what_a_verb_wrote_is_known_again(verb):
    """By `show`, `check` and `report`; an export is for other tools."""
    assert MARKS.keys() & set(asked.loaded(COMMANDS[verb].files))


class Called(Exception):
    """The function was called."""


@pytest.mark.parametrize(("line", "given"), LINES, ids=[line for line, _ in LINES])
def test_a_command_line_is_a_call_of_the_function(monkeypatch, line, given):
    """With the words as Python has them; what was not said is left to the function's own defaults."""
    whole = asked.loaded

    def loaded(home):
        def function(*words, **options):
            called.append(options | ({"sources": words} if words else {}))
            raise Called

        return function if home == COMMANDS[line.split()[0]].function else whole(home)

    called: list[dict[str, object]] = []
    monkeypatch.setattr(asked, "loaded", loaded)
    monkeypatch.setattr(asked.Asked, "writing", lambda *_, **__: contextlib.nullcontext())
    monkeypatch.setattr(asked.Asked, "check", lambda *_: None)
    assert app.run(line.split()) == 1
    (options,) = called
    assert {name: options.get(name) for name in given} == given


@pytest.mark.parametrize(("verb", "said"), [("identify", 'by default "identified"'), ("modes", "without it nothing")])
def test_the_help_of_output_says_what_happens_without_it(verb, said):
    assert said in OPTIONS[verb]["--output"]


MOST_OPTIONS = 12
"""Of a command, beside those that all share: as many as a help page shows at once; what is longer goes into a file."""

SHARED = {"--set", "--law", "--seed", "--threads", "--on", "--output", "--resume", "--overwrite", "--report", "--json"}
"""Options that mean the same in every verb that takes them."""

OF_THE_LINE = {
    "--set",
    "--law",  # make the scene that the function is given
    "--output",
    "--overwrite",
    "--report",
    "--mat",
    "--static",
    "--json",
    "--browser",  # what becomes of the result
    "--against",  # what is shown beside the result
    "--on",  # names what `threads` takes as an object
}
"""Options that are about words, files and the console."""

OTHERWISE = {
    "design gait --limit": {"limits"},
    "simulate --starts": set(),  # what `tarsus.attractors` finds, shown beside the run
    "validate --all": {"name"},
}
"""An option that the function takes as several arguments."""

SECOND = {"simulate": {"duration"}}
"""Words that may stand without their name, in that place."""

NOT_OF_PYTHON = {"completion", "design request"}
"""Commands that print what a shell or an editor takes."""

DESIGN = {"foot", "over", "free", "limits"}
"""Settings of designs that are options too."""


LONG = {
    verb: {word for word in words if word.startswith("--") and not word.startswith("--no-")}
    for verb, words in OPTIONS.items()
}
"""Long names of the options of every command."""


def function_of(verb: str) -> Any:
    """What the package has under the words of a command."""
    one: Any = package
    for word in verb.split():
        one = getattr(one, word, None) or getattr(one, f"{word}_")
    return one


def parameters(function: Any) -> set[str]:
    """Names of its arguments; of a room that is a verb too, those of the verb."""
    found = inspect.signature(function).parameters
    settings = any(one.kind is one.VAR_KEYWORD for one in found.values())  # as `design.request` names them
    return set(found) | (DESIGN if settings else set())


@pytest.mark.parametrize("verb", sorted(set(LONG) - NOT_OF_PYTHON))
def test_words_of_all_verbs_are_named_in_python(verb):
    taken = inspect.signature(function_of(verb)).parameters
    shared = taken.keys() & {"law", "seed", "threads", "resume", "duration", "progress"}
    assert all(taken[name].kind is inspect.Parameter.KEYWORD_ONLY for name in shared - SECOND.get(verb, set()))


@pytest.mark.parametrize("verb", sorted(LONG))
def test_a_command_has_few_options(verb):
    assert len(LONG[verb] - SHARED) <= MOST_OPTIONS


@pytest.mark.parametrize("verb", sorted(set(LONG) - NOT_OF_PYTHON))
def test_a_command_is_a_function_with_the_same_words(verb):
    taken = parameters(function_of(verb))
    for option in LONG[verb] - OF_THE_LINE:
        word = option.removeprefix("--").replace("-", "_")
        assert OTHERWISE.get(f"{verb} {option}", {word}) <= taken, option


@pytest.mark.parametrize("verb", COMMANDS)
def test_defaults_that_are_shown_are_those_of_the_function(verb):
    """They are read from the file of a function, which is not loaded for it."""
    declared = COMMANDS[verb].declared
    module, name = declared.home.split(":")
    real = inspect.signature(getattr(importlib.import_module(module), name)).parameters
    taken = {one.name: one for one in declared.arguments}
    assert list(taken) == [one.name for one in real.values() if one.kind is not one.VAR_KEYWORD]
    for argument in taken.values():
        default = NO_DEFAULT if argument.many else argument.default
        assert default in (None, real[argument.name].default) or default is NO_DEFAULT
        assert argument.said, f"{verb}: {argument.name} is not explained"


def test_quiet_leaves_results_and_errors_and_names_no_files(tarsus, tmp_path):
    words = ("simulate", "cantilever", "--duration", "1 ms", "--set", "robot.feet.tip.gap=70", "--no-report", "-o")
    usual, quiet = tarsus(*words, tmp_path / "a"), tarsus(*words, tmp_path / "b", "-q")
    assert any(one.startswith("note: robot.feet.tip.gap: 70 m is far") for one in usual.sentences) and quiet.err == ""
    first = [line for line in usual.out.splitlines() if "energy" in line]
    assert first and first == [line for line in quiet.out.splitlines() if "energy" in line]
    assert "wrote" in usual.out and "wrote" not in quiet.out and (tmp_path / "b" / "series.nc").exists()
    assert tarsus("--quiet", "show", "nowhere").sentences


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
    assert "Traceback" in said and "this is a defect of tarsus" in said.splitlines()[-1]


@pytest.mark.parametrize(
    ("words", "now"),
    [
        *((name, now) for name, now in former.COMMANDS.items()),
        *former.OPTIONS.items(),
        *((f"{verb or 'atlas'} {option} {value}", now) for verb, option, value, now in former.VALUES),
    ],
)
def test_a_former_word_is_answered_with_the_present_one(tarsus, words, now):
    said = tarsus(*words.split(), "x")
    (sentence,) = said.sentences
    assert (said.code, said.out) == (2, "")
    assert words.split()[-1] in sentence and sentence.endswith(f" is gone: use {now}")
