"""What the words of a command line ask for: settings, scene, duration, folder.

Bad input ends in `InputError`, with everything found wrong.
"""

from __future__ import annotations

import contextlib
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from tarsus.base.errors import InputError
from tarsus.cli import console
from tarsus.cli.named import texts_of

if TYPE_CHECKING:
    from tarsus.base.workers import Workers
    from tarsus.model.scene import Scene
    from tarsus.study.sweep import Sweep

_LAWS = "ground.laws."


def settings(words: Sequence[str], option: str = "--set") -> dict[str, Any]:
    """`path=value` words: numbers, texts with a unit, lists and tables as TOML writes them, or `none`."""
    return {path: _value(f"{option} {path}", text) for path, text in texts_of(words, option).items()}


def _value(label: str, text: str) -> Any:
    if text.lower() == "none":
        return None
    from tarsus.files.tables import NotToml, table_of

    try:
        return table_of(f"value = {text}", label)["value"]
    except NotToml:
        return text


def scene_for(name: str, values: dict[str, Any], law_files: Sequence[Path]) -> Scene:
    """The scene a command line names, with its settings applied.

    Laws of the files that the scene does not hold already are added with their default values.
    """
    scene = _changed(name, values, law_files)
    console.detail(
        f"{scene.name}: coordinates {scene.robot.structure.size}, drives {len(scene.robot.drives)}, "
        f"feet {len(scene.robot.feet)}, {scene.duration:g} s; values set {len(values)}"
    )
    return scene


def _changed(name: str, values: dict[str, Any], law_files: Sequence[Path]) -> Scene:
    from tarsus.files.library import changed, load_scene

    if not law_files:
        return changed(load_scene(name), **values)
    from tarsus.base.spec import validate
    from tarsus.model.laws.userfile import laws_of
    from tarsus.model.scene import override

    laws = laws_of(law_files)
    in_file = load_scene(name, laws=laws).ground.laws
    present = {*in_file, *(law.name() for law in in_file.values())}
    own: dict[str, dict[str, Any]] = {law_name: {} for law_name in laws if law_name not in present}
    rest: dict[str, Any] = {}
    for path, value in values.items():
        law_name, dot, field = path.removeprefix(_LAWS).partition(".")
        if path.startswith(_LAWS) and dot and law_name in own:
            own[law_name][field] = value
        else:
            rest[path] = value
    scene = changed(load_scene(name, laws=laws), **rest)
    made = {
        f"{_LAWS}{law_name}": validate(laws[law_name], given, prefix=f"{_LAWS}{law_name}")
        for law_name, given in own.items()
    }
    return override(scene, made, by="a law file") if made else scene


def refuse_too_long(scene: Any, duration: str) -> None:
    """Raise InputError for a duration of a scene that is out of reach, or none."""
    from tarsus.model.scene import Scene, seconds_of
    from tarsus.solve import too_long

    if isinstance(scene, Scene) and (said := too_long(scene, seconds_of(scene, duration))):
        raise InputError(f"duration: {said}")


def is_study(name: str) -> bool:
    """Whether a name is that of a study, packaged or a file."""
    from tarsus.files.installed import kind_of
    from tarsus.files.tables import FileKind

    return kind_of(name) is FileKind.SWEEP


def study_for(name: str, values: dict[str, Any], law_files: Sequence[Path]) -> Sweep:
    """The study of a name, with settings of its scene applied."""
    from tarsus.base.spec import with_values
    from tarsus.files.library import changed
    from tarsus.model.laws.userfile import laws_of
    from tarsus.study.studyfile import load_sweep

    study = load_sweep(name, laws_of(law_files))
    return with_values(study, {"scene": changed(study.scene, **values)}) if values else study


@contextlib.contextmanager
def workers_for(on: str | None, threads: int | None = None) -> Iterator[Workers]:
    """The workers of the Dask cluster that `--on` names, for the length of a block; without it the threads."""
    if on is None:
        console.detail("worker threads: " + ("one for each processor" if threads is None else str(threads)))
        yield threads
        return
    from tarsus.cluster.dask import dask_executor

    with dask_executor(on, threads) as executor:
        yield executor
