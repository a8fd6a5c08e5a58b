"""Scenes in TOML: unit strings at the edge, exact round trip, all errors of a wrong file at once."""

from __future__ import annotations

import inspect
import os
from collections.abc import Mapping
from enum import Enum
from pathlib import Path
from typing import Any

from tarsus.base.errors import InputError
from tarsus.base.spec import Description, described, quantity_units, validate, with_values
from tarsus.base.units import format_quantity
from tarsus.base.verb import verb
from tarsus.files.tables import FileKind, read_table, table_of
from tarsus.files.whole import write_text
from tarsus.model.laws import Law
from tarsus.model.scene import Scene, provenance_faults, provenance_problems

SCENE_FILE, STUDY_FILE = "scene.toml", "study.toml"
LAW_FOLDER = "laws"
"""What folders that verbs write call the descriptions that they were made from."""

_LONGEST_TEXT_LIST = 36
"""Lists of more numbers than this are written as plain SI floats, without units."""


@verb
def read_scene(path: str | os.PathLike[str], laws: Mapping[str, type[Law]] | None = None) -> Scene:
    """Read a scene from a TOML file.

    Parameters
    ----------
    path
        The file.
    laws
        Classes of user laws by name (`tarsus.load_laws`), for tables below ``ground.laws``.

    Returns
    -------
    Scene
        The description, as `load_scene` gives it.

    Raises
    ------
    InputError
        With every problem of the file: path, what was expected, nearest valid name.
    """
    file = Path(path)
    table = read_table(file, FileKind.SCENE)
    return _scene_of(table, laws, file.parent)


def parse_scene(
    text: str, *, laws: Mapping[str, type[Law]] | None = None, folder: Path | None = None, label: str = "scene"
) -> Scene:
    """A scene from TOML text; as `read_scene`.

    Parameters
    ----------
    text
        TOML.
    laws
        Classes of user laws by name.
    folder
        Where relative paths inside the scene start.
    label
        Name of the text in errors about its syntax.
    """
    return _scene_of(table_of(text, label), laws, folder)


def _scene_of(table: Mapping[str, Any], laws: Mapping[str, type[Law]] | None, folder: Path | None) -> Scene:
    """A scene from its raw table, all faults of which are found."""
    context = {"laws": dict(laws or {}), "folder": folder}
    return validate(Scene, table, context=context, further=provenance_problems)


def write_scene(scene: Scene, path: str | os.PathLike[str]) -> None:
    """Write a scene as a TOML file that `read_scene` reads back to an equal scene.

    Raises InputError for what is no scene, such as a device's name, and where the file cannot be written.
    """
    described(scene)
    write_text(Path(path), scene_text(scene))


def scene_text(scene: Scene) -> str:
    """A scene as TOML text, quantities as unit strings; without the provenance of what it no longer has, as of a signal
    that another one has taken the place of."""
    stale = provenance_faults(scene)
    if stale:
        kept = {path: origin for path, origin in scene.provenance.items() if path not in stale}
        scene = with_values(scene, {"provenance": kept})
    return description_text(scene)


def scene_texts(scene: Scene) -> dict[str, str]:
    """A scene and the files of its user's laws as texts by name, such as ``laws/own.py``.

    Raises InputError where two law files have one name.
    """
    files = {Path(inspect.getfile(type(law))) for law in scene.ground.laws.values()}
    # by their names alone: whoever reads them back has them all in one folder
    laws = {f"{LAW_FOLDER}/{file.name}": file for file in sorted(files, key=lambda file: file.name)}
    if len(laws) < len(files):
        raise InputError("law files of one scene need different names")
    return {SCENE_FILE: scene_text(scene), **{name: file.read_text(encoding="utf-8") for name, file in laws.items()}}


def description_text(description: Description) -> str:
    """Any description as TOML text, quantities as unit strings."""
    import tomlkit

    document = tomlkit.document()
    _fill(document, _table(description))
    return tomlkit.dumps(document)


def _count(value: Any) -> int:
    if isinstance(value, Mapping):
        return sum(_count(v) for v in value.values())
    return sum(_count(v) for v in value) if isinstance(value, tuple) else 1


def _plain(value: Any, unit: str | None) -> Any:
    """A field's value as TOML types; floats with a unit become unit strings."""
    if isinstance(value, Description):
        return _table(value)
    if isinstance(value, Enum):
        return value.value
    if isinstance(value, Mapping):
        return {
            key: {"kind": item.name(), **_table(item)} if isinstance(item, Law) else _plain(item, unit)
            for key, item in value.items()
        }
    if isinstance(value, tuple):
        return [_plain(item, unit) for item in value]
    if isinstance(value, float) and unit not in (None, "1"):
        return format_quantity(value, str(unit))
    return value


def _table(description: Description) -> dict[str, Any]:
    units = quantity_units(type(description))
    table: dict[str, Any] = {}
    for name, field in sorted(type(description).model_fields.items(), key=lambda item: item[0] != "kind"):
        value = getattr(description, name)
        if value is None or (isinstance(value, (tuple, dict)) and not value and not field.is_required()):
            continue
        if value is False and field.default is False:
            continue
        unit = units.get(name)
        if isinstance(value, tuple) and _count(value) > _LONGEST_TEXT_LIST:
            unit = None
        plain = _plain(value, unit)
        if plain != {} or field.is_required() or field.default is None:  # an empty table is not an absent one
            table[name] = plain
    return table


def _fill(target: Any, table: Mapping[str, Any]) -> None:
    """Fill a tomlkit container: values first, then tables, small leaf tables of provenance inline."""
    import tomlkit

    for key, value in table.items():
        if not isinstance(value, dict):
            target.add(key, _array(value) if isinstance(value, list) else value)
    for key, value in table.items():
        if not isinstance(value, dict):
            continue
        child = tomlkit.table(is_super_table=bool(value) and all(isinstance(v, dict) for v in value.values()))
        if key == "provenance":
            child = tomlkit.table()
            for path, origin in value.items():
                entry = tomlkit.inline_table()
                entry.update(origin)
                child.add(path, entry)
        else:
            _fill(child, value)
        target.add(key, child)


def _array(values: list[Any]) -> Any:
    import tomlkit

    array = tomlkit.array()
    for value in values:
        array.append(_array(value) if isinstance(value, list) else value)
    return array.multiline(bool(values) and (isinstance(values[0], list) or len(str(values)) > 90))
