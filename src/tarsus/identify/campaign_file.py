"""A campaign file written short: what all sets share, sets that are like another one, patterns of file names."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from fnmatch import fnmatchcase
from pathlib import Path
from typing import Any

from tarsus.base.messages import PathErrors, nearest

OWN = ("files", "air", "like")
"""What no set takes from another one: its files, and those with the same drive in the air."""

_PATTERN = re.compile(r"[*?\[]")
_NUMBER = re.compile(r"(\d+)")


def spread(sets: Mapping[str, Any], defaults: Mapping[str, Any]) -> dict[str, Any]:
    """Raw sets of records with what they take from others (``like``) and from the defaults.

    What a set says itself wins; channels are merged by their names, a signal by its fields unless it is of another
    kind.

    Raises
    ------
    PathErrors
        For a set that is like one that is not there, or that is like itself in the end.
    """
    return {name: _merged(_whole(name, sets, ()), defaults) for name in sets}


def _whole(name: str, sets: Mapping[str, Any], above: tuple[str, ...]) -> Any:
    """A raw set with what it takes from those that it is like; above: those that asked for it."""
    one = sets[name]
    if not isinstance(one, dict) or not isinstance(like := one.get("like"), str):
        return one
    where = f"records.{name}.like"
    if like not in sets:
        others = [one for one in sets if one != name]
        raise PathErrors([(where, f"there is no set of records '{like}'{nearest(like, others)}")])
    if like in (*above, name):
        raise PathErrors([(where, f"'{like}' is like '{name}' itself")])
    other = _whole(like, sets, (*above, name))
    if not isinstance(other, dict):
        return one
    base = {key: value for key, value in other.items() if key not in OWN}
    mine, its = one.get("signal"), base.get("signal")
    if isinstance(mine, dict) and isinstance(its, dict) and mine.get("kind") in (None, its.get("kind")):
        one = {**one, "signal": {**its, **mine}}
    return _merged(one, base)


def _merged(one: Any, common: Mapping[str, Any]) -> Any:
    """A raw set with what is common; its channels, where it lists names alone, are those names."""
    if not isinstance(one, dict):
        return one
    own, other = one.get("channels", {}), common.get("channels", {})
    if isinstance(own, list) and isinstance(other, dict):
        channels: Any = {name: other.get(name, {}) for name in own}
    elif isinstance(own, dict) and isinstance(other, dict):
        channels = {**other, **own}
    else:
        channels = own or other
    return {**common, **one, "channels": channels}


def matching(folder: Path, files: Iterable[str]) -> tuple[str, ...]:
    """Files with patterns (``ramps-*.mat``) replaced by the names that they match, numbers in their order.

    A name that is there as it stands is no pattern; a pattern that nothing matches stays, to be reported as missing.
    """
    out: list[str] = []
    for file in files:
        found: list[str] = []
        if _PATTERN.search(file) and not (folder / file).exists() and not Path(file).is_absolute():
            found = [one.relative_to(folder).as_posix() for one in folder.glob(file) if one.is_file()]
        out += sorted(found, key=_natural) or [file]
    return tuple(out)


def is_pattern(file: str) -> bool:
    """Whether a name of files is a pattern."""
    return _PATTERN.search(file) is not None


def _natural(name: str) -> list[tuple[int, str]]:
    """Order of names in which 2 comes before 10."""
    return [(int(part), "") if part.isdecimal() else (-1, part) for part in _NUMBER.split(name)]


def short_text(campaign: Mapping[str, Any]) -> str:
    """A raw campaign as TOML: a set with channels of its own whole, others in a line each."""
    import tomlkit

    document = tomlkit.document()
    for key, value in campaign.items():
        if key != "records":
            document.add(key, value)
    every = [file for one in campaign["records"].values() for file in one["files"]]
    whole: dict[str, dict[str, Any]] = {}
    records, lines = tomlkit.table(is_super_table=True), []
    for name, given in campaign["records"].items():
        one = {**given, "files": pattern_of(given["files"], every)}
        like = [
            _line(name, {"like": key, **_different(one, other)}) for key, other in whole.items() if _fits(one, other)
        ]
        if like:
            lines.append(min(like, key=len))
            continue
        whole[name] = one
        table = tomlkit.table()
        for key, value in one.items():
            if key != "channels":
                table.add(key, _inline(value))
        if "channels" in one:
            channels = tomlkit.table()
            for channel, choice in one["channels"].items():
                channels.add(channel, _inline(choice))
            table.add("channels", channels)
        records.add(name, table)
    document.add("records", records)
    return tomlkit.dumps(document) + "".join(["\n[records]\n", *lines] if lines else [])


def _fits(one: Mapping[str, Any], other: Mapping[str, Any]) -> bool:
    """Whether a set can be like another one: it says all that the other says, and has the same channels."""
    return one.get("channels") == other.get("channels") and set(other) - set(OWN) <= set(one)


def _different(one: Mapping[str, Any], other: Mapping[str, Any]) -> dict[str, Any]:
    """What a raw set says otherwise than another one, but its files."""
    out = {key: value for key, value in one.items() if key in OWN or value != other.get(key)}
    mine, its = out.get("signal"), other.get("signal")
    if isinstance(mine, dict) and isinstance(its, dict) and mine["kind"] == its["kind"] and set(its) <= set(mine):
        out["signal"] = {key: value for key, value in mine.items() if value != its.get(key)}
    return out


def pattern_of(files: list[str], every: list[str]) -> str | list[str]:
    """Files of a set as one pattern, where it matches them and no other of all files; one file by its name."""
    first = Path(files[0])
    pattern = re.sub(r"\d+$", "*", first.stem) + first.suffix
    matched = sorted(file for file in every if fnmatchcase(file, pattern))
    if len(files) == 1:
        return files[0]
    return pattern if matched == sorted(files) else files


def _inline(value: Any) -> Any:
    """A value in one line."""
    import tomlkit

    if not isinstance(value, dict):
        return value
    table = tomlkit.inline_table()
    table.update({key: _inline(one) for key, one in value.items()})
    return table


def _line(name: str, one: Mapping[str, Any]) -> str:
    """A set in one line: the key and an inline table."""
    import tomlkit

    return tomlkit.dumps({name: _inline(dict(one))})
