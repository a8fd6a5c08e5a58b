"""Scenes by the name of a device or the path of a file, with some values changed."""

from __future__ import annotations

import difflib
import os
from collections.abc import Iterator, Mapping
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

from pydantic import BaseModel

from tarsus.base.errors import InputError, InputProblem
from tarsus.base.messages import alternatives, kind_of, nearest
from tarsus.base.verb import verb
from tarsus.files.installed import device_names, device_path, is_path
from tarsus.files.toml import read_scene
from tarsus.model.drive.waveforms import Waveform
from tarsus.model.scene import SHORT_WORDS, Scene, override

if TYPE_CHECKING:
    from tarsus.model.laws import Law

__all__ = ["SceneLike", "as_scene", "changed", "device_names", "flat_values", "load_scene", "scene_of_study"]

SceneLike = Scene | str | os.PathLike[str]
"""A scene, or what `load_scene` takes for one: a device's name, or a scene file's path."""


@lru_cache(maxsize=64)
def _device(name: str) -> Scene:
    return read_scene(device_path(name))


@verb
def as_scene(scene: SceneLike, /, **values: Any) -> Scene:
    """The scene itself, or the device or scene file that is named, with some values changed; values and errors as for
    `load_scene`."""
    found = scene if isinstance(scene, Scene) else load_scene(scene)
    return changed(found, **values) if values else found


@verb
def load_scene(
    name: str | os.PathLike[str],
    /,
    *,
    volts: float | str | None = None,
    hz: float | str | None = None,
    wave: str | None = None,
    laws: Mapping[str, type[Law]] | None = None,
    **values: Any,
) -> Scene:
    """A device by name, or a scene file by path, with some values changed.

    Parameters
    ----------
    name
        One of `device_names`, or the path of a TOML file.
    volts
        Amplitude of the signal [V] (of every signal, if there are several), or the upper voltage of the gait.
    hz
        Frequency of the signal, or of the gait [Hz].
    wave
        Kind of the signal, such as ``"square"`` or ``"sine"``; amplitude, frequency, phase and offset are
        kept.
    laws
        Classes of user laws by name (`tarsus.load_laws`), where the file has tables below ``ground.laws``.
    **values
        Path to new value, ``**{"ground.film.coefficient": "1.5e-21 N m^2 s"}``; provenance follows.

    Returns
    -------
    Scene
        The description, frozen; `with_values` makes changed copies.

    Raises
    ------
    InputError
        For an unknown name or path, and every refused value.

    Examples
    --------
    >>> import tarsus as ts
    >>> scene = ts.load_scene("cantilever", volts=6, hz=100, wave="sine")
    >>> scene.signals["pzt"].amplitude
    6.0
    >>> ts.load_scene("cantilever", **{"robot.feet.tip.gap": "60 um"}).robot.feet["tip"].gap
    6e-05
    """
    text = os.fspath(name)
    if is_path(text):
        scene = read_scene(text, laws)
    elif laws:
        scene = read_scene(device_path(text), laws)
    else:
        scene = _device(text)
    return changed(scene, volts=volts, hz=hz, wave=wave, **values)


def changed(
    scene: Scene,
    /,
    *,
    volts: float | str | None = None,
    hz: float | str | None = None,
    wave: str | None = None,
    **values: Any,
) -> Scene:
    """A scene with some values changed; arguments and errors as for `load_scene`."""
    misspelt = {path: near for path in values if (near := _meant(path))}
    problems = [f"{path}: unknown name; did you mean '{near}'?" for path, near in misspelt.items()]
    known = {path: value for path, value in values.items() if path not in misspelt}
    signals, others = _signal_changes(scene, known, problems, volts=volts, hz=hz, wave=wave)
    changes = {**signals, **others}
    try:
        found = override(scene, changes) if changes else scene
    except InputError as error:
        problems += error.problems
    if problems:
        raise InputError(problems)
    return found


def _meant(name: str) -> str | None:
    """Which of the short names a name is close to that is neither one nor a field of scenes."""
    if "." in name or name in Scene.model_fields:
        return None
    return next(iter(difflib.get_close_matches(name.lower(), _SHORT, n=1, cutoff=0.65)), None)


_KEPT = ("amplitude", "frequency", "phase", "offset")
"""Fields that mean the same in every waveform that has them."""


def _signal_changes(
    scene: Scene, values: Mapping[str, Any], problems: list[str], *, volts: Any, hz: Any, wave: str | None
) -> tuple[dict[str, Any], dict[str, Any]]:
    """Signals that change as a whole (sugar, or a new kind), what changes of the gait, and the values left; faults go
    to ``problems``, and what else is asked for is kept, so that its faults are found as well."""
    asked = {word: value for word, value in (("volts", volts), ("hz", hz)) if value is not None}
    sugar = {SHORT_WORDS[word][0]: value for word, value in asked.items()}
    if (sugar or wave is not None) and not scene.signals and scene.gait is None:
        problems.append("the scene has no signal to change; give signals in its file")
        return {}, dict(values)
    if wave is not None and not scene.signals:
        problems.append(f"the drives follow a gait, which is made of square waves: it cannot take wave={wave}")
    others = dict(values)
    changes: dict[str, Any] = {}
    if scene.gait is not None:
        changes = {f"gait.{SHORT_WORDS[word][1]}": value for word, value in asked.items()}
    kinds = {str(kind_of(member)): member for member in alternatives(Waveform)}
    for name, signal in scene.signals.items():
        prefix = f"signals.{name}."
        kind = others.get(f"{prefix}kind", wave)
        if not sugar and kind is None:
            continue
        own = {path.removeprefix(prefix): others.pop(path) for path in values if path.startswith(prefix)}
        own.pop("kind", None)
        cls: type[BaseModel] = type(signal)
        kept = {key: getattr(signal, key) for key in cls.model_fields if key != "kind"}
        if kind is not None and kind != kind_of(cls):
            if kind not in kinds:
                problems.append(f"{prefix}kind: there is no wave '{kind}'{nearest(str(kind), kinds)}")
                changes[f"signals.{name}"] = {**kept, "kind": kind_of(cls), **_fitting(sugar, cls)}
                continue
            cls = kinds[kind]
            kept = {key: kept[key] for key in _KEPT if key in kept and key in cls.model_fields}
        problems += [
            f"signals.{name}: a {kind_of(cls)} wave has no {key}" for key in sugar if key not in cls.model_fields
        ]
        changes[f"signals.{name}"] = {**kept, "kind": kind_of(cls), **_fitting(sugar, cls), **own}
    return changes, others


def _fitting(sugar: Mapping[str, Any], cls: type[BaseModel]) -> dict[str, Any]:
    return {key: value for key, value in sugar.items() if key in cls.model_fields}


_SHORT = (*SHORT_WORDS, "wave")
"""Names of settings that stand for the values of every signal."""

_AXIS_FIELDS = {"kind", "paths", "values", "start", "stop", "count"}
"""Names in a table that make it the axis of a sweep, and no part of a path."""


def scene_of_study(named: Any, settings: Any, folder: Path, laws: Mapping[str, type[Law]] | None) -> Scene:
    """The scene that a study names (a device, or a file from the study's folder) with its settings."""
    if not isinstance(named, str):
        raise InputError(
            InputProblem.at("scene", f"expected the name of a device or the path of a scene file, got {named!r}")
        )
    if not isinstance(settings, Mapping):
        raise InputError(f"set: expected a table of paths and values, got {settings!r}")
    values = dict(flat_values(settings))
    short = {key: values.pop(key) for key in _SHORT if key in values}
    try:
        scene = load_scene(folder / named if is_path(named) else named, laws=laws, **short)
    except InputError as error:
        raise InputError([InputProblem.at("scene", problem) for problem in error.problems]) from None
    try:
        return override(scene, values, by="a study") if values else scene
    except InputError as error:
        raise InputError([f"set.{problem}" for problem in error.problems]) from None


def flat_values(table: Mapping[str, Any], prefix: str = "") -> Iterator[tuple[str, Any]]:
    """Values by path, whether its names were written as one quoted key or as nested tables."""
    for key, value in table.items():
        path = f"{prefix}{key}"
        if isinstance(value, Mapping) and value and "." not in key and not _AXIS_FIELDS & set(value):
            yield from flat_values(value, f"{path}.")
        else:
            yield path, value
