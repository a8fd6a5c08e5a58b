"""Verbs are the interface: every command is a function of the package with the same words, and has few options."""

from __future__ import annotations

import inspect
from typing import Any

import pytest

import tarsus
from cli_options import options_by_verb

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

NOT_OF_PYTHON = {"completion", "design request"}
"""Commands that print what a shell or an editor takes."""

DESIGN = {"foot", "over", "free", "limits"}
"""Settings of designs that are options too."""


OPTIONS = {
    verb: {word for word in words if word.startswith("--") and not word.startswith("--no-")}
    for verb, words in options_by_verb().items()
}
"""Long names of the options of every command."""


def function_of(verb: str) -> Any:
    """What the package has under the words of a command."""
    one: Any = tarsus
    for word in verb.split():
        one = getattr(one, word, None) or getattr(one, f"{word}_")
    return one


def parameters(function: Any) -> set[str]:
    """Names of its arguments; of a room that is a verb too, those of the verb."""
    found = inspect.signature(function).parameters
    settings = any(one.kind is one.VAR_KEYWORD for one in found.values())  # as `design.request` names them
    return set(found) | (DESIGN if settings else set())


@pytest.mark.parametrize("verb", sorted(OPTIONS))
def test_a_command_has_few_options(verb):
    assert len(OPTIONS[verb] - SHARED) <= MOST_OPTIONS


@pytest.mark.parametrize("verb", sorted(set(OPTIONS) - NOT_OF_PYTHON))
def test_a_command_is_a_function_with_the_same_words(verb):
    taken = parameters(function_of(verb))
    for option in OPTIONS[verb] - OF_THE_LINE:
        word = option.removeprefix("--").replace("-", "_")
        assert OTHERWISE.get(f"{verb} {option}", {word}) <= taken, option
