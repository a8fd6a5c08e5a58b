"""Options of every command with their help: {"simulate": {"--set": "path=value ..."}}."""

from __future__ import annotations

from functools import cache
from typing import Any

from tarsus.cli import app


@cache
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
