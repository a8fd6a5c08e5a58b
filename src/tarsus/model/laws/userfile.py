"""A user's law in one plain Python file."""

from __future__ import annotations

import math
import os
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path

from tarsus.base.errors import InputError
from tarsus.base.pythonfile import Endless, execute, line_of, patience, said
from tarsus.model.laws.base import AdhesionLaw, DampingLaw, FrictionLaw, ImpactLaw, Law, SmoothLaw
from tarsus.model.laws.translate import translate

PURPOSE = "a law file only defines laws"
_PROTOCOLS = (DampingLaw, SmoothLaw, ImpactLaw, AdhesionLaw, FrictionLaw)
_TRIAL = {
    "gap": 1e-6,
    "gap_rate": -1e-3,
    "volts": 1.0,
    "time": 1e-3,
    "speed": 1e-3,
    "age": 1e-3,
    "away": 1e-3,
    "margin": 1e-6,
    "strength": 1e-6,
}
"""What a law is tried with when its file is read [SI]: numbers of a foot near the ground, where a law has a value."""


def laws_of(files: Iterable[str | os.PathLike[str]]) -> dict[str, type[Law]]:
    """The laws of all files by name. Raises InputError where two files have one of the same name."""
    laws: dict[str, type[Law]] = {}
    for file in files:
        for name, law in load_laws(Path(file)).items():
            if name in laws:
                raise InputError(f"{file}: a law named '{name}' is already given by another file")
            laws[name] = law
    return laws


def load_laws(path: str | Path) -> dict[str, type[Law]]:
    """The laws defined in a Python file, by their snake_case names.

    The file is executed, for some seconds at most.  A law in it is a subclass of `DampingLaw`, `SmoothLaw`,
    `ImpactLaw`, `AdhesionLaw` or `FrictionLaw` with its function; each function is translated into the program that
    the engine carries out, and tried once with plausible numbers.

    Parameters
    ----------
    path
        A ``.py`` file.

    Returns
    -------
    dict[str, type[Law]]
        Classes by name, for ``ground.laws`` of a scene.

    Raises
    ------
    InputError
        If the file is missing, raises (with its line number), defines no law, or a law's function raises,
        gives no finite number or contains what a law may not.
    """
    file = Path(path)
    if not file.is_file():
        raise InputError(f"{file}: no such law file")
    module = execute(file, PURPOSE)
    laws = {
        value.name(): value
        for value in vars(module).values()
        if isinstance(value, type) and issubclass(value, Law) and value.__module__ == module.__name__
    }
    if not laws:
        names = ", ".join(p.__name__ for p in _PROTOCOLS)
        raise InputError(f"{file}: defines no law; a law is a class derived from one of {names}")
    problems = [problem for law in laws.values() for problem in _problems(file, law)]
    if problems:
        raise InputError(problems)
    return laws


def _problems(file: Path, law: type[Law]) -> list[str]:
    if not issubclass(law, _PROTOCOLS):
        names = ", ".join(p.__name__ for p in _PROTOCOLS)
        return [f"{file}: law {law.__name__} must be derived from one of {names}"]
    function = law.function()
    if function is None:
        wanted = ", ".join((*law.leading, *law.names()))
        return [f"{file}: law {law.__name__} defines no function {law.function_name}({wanted})"]
    leading = {law.hook: law.leading, **law.also}
    for hook, (one, _) in law.functions().items():
        if faults := _tried(file, law, one, leading[hook]):
            return faults
    return []


def _tried(file: Path, law: type[Law], function: Callable[..., float], leading: Sequence[str]) -> list[str]:
    """What is wrong with one of a law's functions."""
    try:
        with patience(str(file), PURPOSE):
            translate(function, len(leading))  # before it is tried: what can be recorded comes to an end
    except InputError as error:
        return [f"{file}: {problem}" for problem in error.problems]
    except Endless as error:
        return [f"{file}{line_of(error, file)}: {said(error)}"]
    trial = [_TRIAL[name] for name in leading]
    values = [_trial_value(law, name) for name in law.names()]
    try:
        result = function(*trial, *values)
    except Exception as error:
        return [f"{file}{line_of(error, file)}: law {law.__name__} raised {said(error)}"]
    if isinstance(result, bool) or not isinstance(result, (int, float)) or not math.isfinite(result):
        return [f"{file}: law {law.__name__} must return a finite number, got {result!r}"]
    return []


def _trial_value(law: type[Law], name: str) -> float:
    """The default of a parameter, or some value inside its bounds."""
    field = law.model_fields[name]
    if not field.is_required():
        return float(field.default)
    extra = field.json_schema_extra if isinstance(field.json_schema_extra, dict) else {}
    bounds = {k: float(v) for k, v in extra.items() if isinstance(v, (int, float))}
    low, high = bounds.get("gt", bounds.get("ge")), bounds.get("lt", bounds.get("le"))
    if low is not None and high is not None:
        return 0.5 * (low + high)
    if low is not None:
        return low + 1.0
    return high - 1.0 if high is not None else 1.0
