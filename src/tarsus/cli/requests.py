"""What the words of a command line ask for: settings, scene, duration, folder.

Bad input ends in `InputError`, with everything found wrong.
"""

from __future__ import annotations

import contextlib
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, overload

from tarsus.base.errors import InputError
from tarsus.cli import console

if TYPE_CHECKING:
    from tarsus.base.workers import Workers
    from tarsus.cli.options import Changes
    from tarsus.model.scene import Scene

_LAWS = "ground.laws."


def texts_of(words: Sequence[str], option: str) -> dict[str, str]:
    """`name=text` words by name."""
    problems = []
    found: dict[str, str] = {}
    for word in words:
        path, equals, text = (one.strip() for one in word.partition("="))
        if not equals or not path or not text:
            problems.append(f"{option} takes path=value, got '{word}'")
        elif path in found:
            problems.append(f"{option} names '{path}' twice")
        else:
            found[path] = text
    if problems:
        raise InputError(problems)
    return found


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


def duration_for(scene: Scene, text: str | None) -> float:
    """Duration [s] of a run: the one asked for, else the scene's own; absurd ones are refused."""
    from tarsus.solve import too_long

    seconds = quantities_of(duration=(text, "s")).get("duration", scene.duration)
    if not seconds > 0.0:
        raise InputError(f"--duration: expected a time (s) above 0, got '{text}'")
    if said := too_long(scene, seconds):
        raise InputError(f"--duration: {said}")
    return seconds


Span = tuple[str, str]
"""Both ends of a range, as texts."""


@overload
def spans_of(words: Sequence[str], option: str) -> dict[str, Span]: ...
@overload
def spans_of(words: Sequence[str], option: str, *, bare: bool) -> dict[str, Span | None]: ...
def spans_of(words: Sequence[str], option: str, *, bare: bool = False) -> Any:
    """`PATH=a:b` words as both ends of a range by path, the only reader of such words.

    With ``bare`` a word may be a path alone, whose range is None, and hold several words with commas.
    """
    takes = f"{option} takes {'PATH or ' * bare}PATH=a:b, such as robot.feet.tip.gap=66um:74um"
    problems: list[str] = []
    found: dict[str, Span | None] = {}
    for word in (part for one in words for part in (one.split(",") if bare else [one])):
        path, equals, span = (one.strip() for one in word.partition("="))
        low, colon, high = (one.strip() for one in span.partition(":"))
        if not path or not (low and colon and high if equals else bare):
            problems.append(f"{takes}, got '{word}'")
        elif path in found:
            problems.append(f"{option} names '{path}' twice")
        else:
            found[path] = (low, high) if equals else None
    if problems:
        raise InputError(problems)
    return found


def axis_of(word: str, option: str) -> tuple[str, str, str, str]:
    """A `PATH=a:b` or `PATH=a:b:log` word as a path, both ends of its range, and "log" or ""."""
    bare, log = (word.removesuffix(":log"), "log") if word.endswith(":log") else (word, "")
    ((path, (low, high)),) = spans_of([bare], option).items()
    return path, low, high, log


def map_of(
    name: str, x: str | None, y: str | None, changes: Changes
) -> tuple[Scene, Sequence[tuple[Any, ...]], tuple[str, ...]]:
    """The scene that a map is of, its two axes, and what is drawn: of words, or without them of a study that is named.
    Raises InputError for one axis alone, and for a study that is none of two numbers."""
    if x is not None and y is not None:
        return changes.scene(name), [axis_of(x, "--x"), axis_of(y, "--y")], ()
    if (x is None) != (y is None):
        raise InputError("--x and --y: give both, or neither and a study of two numbers")
    from tarsus.atlas.axis import axes_of
    from tarsus.files.installed import kind_of
    from tarsus.files.library import changed
    from tarsus.files.tables import FileKind
    from tarsus.model.laws.userfile import laws_of
    from tarsus.study.studyfile import load_sweep

    if kind_of(name) is FileKind.DEVICE:
        raise InputError(
            f"{name}: is a device; say --x PATH=a:b and --y PATH=a:b, or name a study of two numbers"
        )
    study = load_sweep(name, laws_of(changes.law or ()))
    return changed(study.scene, **settings(changes.set_ or ())), axes_of(study), study.draw


@contextlib.contextmanager
def workers_for(on: str | None, threads: int | None = None) -> Iterator[Workers]:
    """The workers of the Dask cluster that `--on` names, for the length of a block; without it the threads."""
    if on is None:
        console.detail("worker threads: " + ("one for each processor" if threads is None else str(threads)))
        yield threads
        return
    kind, address = place_of(on)
    if kind != "dask":
        raise InputError(
            f"--on: expected dask:ADDRESS or dask:local (of a sweep also slurm or array), got '{on}'"
        )
    from tarsus.cluster.dask import dask_executor

    with dask_executor(address, threads) as executor:
        yield executor


def place_of(on: str) -> tuple[str, str]:
    """The kind of a place that `--on KIND:WORDS` names, and the words."""
    kind, _, words = on.partition(":")
    return kind.strip(), words.strip()


def grounds_of(words: Sequence[str]) -> Any:
    """What `--over` asks a design to bear: a file of draws, or a mapping of paths to (low, high), still as text;
    nothing for no words."""
    if len(words) == 1 and words[0].endswith(".npz"):
        return words[0]
    return spans_of(words, "--over") or None


def quantities_of(**given: tuple[str | None, str]) -> dict[str, float]:
    """Quantities [SI] of options by name, each its words and its unit; those that are not given are left out."""
    from tarsus.base.units import parse_quantity

    problems: list[str] = []
    found: dict[str, float] = {}
    for name, (text, unit) in given.items():
        try:
            if text is not None:
                found[name] = parse_quantity(text.strip(), unit)
        except InputError as error:
            problems += [f"--{name}: {one}" for one in error.problems]
    if problems:
        raise InputError(problems)
    return found
