"""Words of a command line that give names values: `name=value`."""

from __future__ import annotations

from collections.abc import Sequence

from tarsus.base.errors import InputError


def texts_of(words: Sequence[str], option: str) -> dict[str, str]:
    """`name=text` words by name."""
    return {name: text for name, text in pairs_of(words, option, f"{option} takes NAME=VALUE").items() if text}


def values_of(words: Sequence[str], option: str) -> dict[str, str | None]:
    """`name=text` words by name, None of a name alone."""
    return pairs_of(words, option, f"{option} takes NAME or NAME=VALUE", alone=True)


def pairs_of(words: Sequence[str], option: str, takes: str, *, alone: bool = False) -> dict[str, str | None]:
    problems: list[str] = []
    found: dict[str, str | None] = {}
    for word in words:
        name, equals, text = (one.strip() for one in word.partition("="))
        if not name or not (text if equals else alone):
            problems.append(f"{takes}, got '{word}'")
        elif name in found:
            problems.append(f"{option} names '{name}' twice")
        else:
            found[name] = text or None
    if problems:
        raise InputError(problems)
    return found
