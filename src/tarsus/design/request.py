"""What a design is asked for: settings in the words of a call, as a mapping, or as a TOML file.

Every design reads the same file: names that stand alone, the grounds in ``[over]``, what is sought in ``[objective]``,
how long and with which random numbers in ``[search]``, and sections of its own. In Python there are no sections::

    foot = "tip"                                        ts.design.landing(
    pairs = 2                                               scene, "tip", pairs=2,
    [over]                                                  over={"robot.feet.tip.gap": ("66 um", "74 um")},
    "robot.feet.tip.gap" = ["66 um", "74 um"]               risk="worst", seed=1,
    [objective]                                         )
    risk = "worst"
    [search]
    seed = 1

`settings_text` writes the file with everything in it that can be set; a command takes it as ``--request FILE``, and
single settings as ``--request NAME=VALUE``.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from enum import Enum
from importlib import import_module
from os import PathLike
from pathlib import Path
from typing import Annotated, Any, ClassVar, TypeVar, get_origin

from pydantic import Field

from tarsus.base.errors import InputError
from tarsus.base.messages import nearest
from tarsus.base.spec import Description, quantity_units, validate
from tarsus.base.units import format_quantity
from tarsus.design.grounds import Over, over_of
from tarsus.design.judge import NOMINAL, WORST, Risk, risk_of
from tarsus.design.problems import Problems, listed
from tarsus.files.tables import FileKind, read_table
from tarsus.model.scene import Scene

T = TypeVar("T")
Given = Mapping[str, Any] | str | PathLike[str] | None
"""Settings as a mapping, or the name of a TOML file."""
Count = Annotated[int, Field(ge=1)]
"""One or more."""
Seed = Annotated[int, Field(ge=0)]


OVER = "numbers that are not known by path, each from its least to its most; or a file of draws"
RISK = "worst, mean, nominal, or {cvar = q}; worst with grounds, else nominal"
SEED = "of everything that is drawn at random"
_KINDS = {
    "design": ("problem", "DesignSettings"),
    "landing": ("landing", "LandingSettings"),
    "gait": ("presets", "GaitSettings"),
    "adapt": ("adaptive", "AdaptSettings"),
    "leg": ("legs", "LegSettings"),
}


BY_PATH = {"free": '"PATH" = [low, high]', "limits": 'MEASURE = "< value"', "over": '"PATH" = [low, high]'}
"""Settings that are tables of a file, and what a line of them is."""
FORMER = {"walks": "runs"}
"""Sections of earlier files."""


def setting(default: Any, doc: str) -> Any:
    """A setting that is no quantity; `tarsus.base.spec.quantity` makes the others."""
    return Field(default=default, description=doc)


class Settings(Description):
    """What a design is asked for. SECTIONS: names of the settings in each section of a file; the one that is named as
    its section is called ``of`` there."""

    SECTIONS: ClassVar[Mapping[str, tuple[str, ...]]] = {}


S = TypeVar("S", bound=Settings)


def settings_of(kind: type[S], request: Given = None, **given: Any) -> S:
    """Settings of a kind from a request; what is ``given`` and not None takes the place of its own.

    Raises
    ------
    InputError
        With everything that does not fit: unknown names, wrong kinds of values, numbers out of range.
    """
    folder = None
    if isinstance(request, (str, PathLike)):
        folder, request = Path(request).parent, read_table(request, FileKind.REQUEST)
    found: dict[str, Any] = {}
    for name, value in (request or {}).items():
        if name in FORMER:
            raise InputError(f"[{name}]: the section is [{FORMER[name]}]")
        if name in kind.SECTIONS and isinstance(value, Mapping):
            found |= {name if key == "of" else key: one for key, one in value.items()}
        else:
            found[name] = dict(_paths(value)) if name in ("over", "free") and isinstance(value, Mapping) else value
    if folder is not None and isinstance(found.get("over"), str):
        found["over"] = folder / found["over"]  # a file of draws lies in the request's folder
    if folder is not None and isinstance(found.get("scene"), str) and (folder / found["scene"]).is_file():
        found["scene"] = str(folder / found["scene"])
    found |= {name: value for name, value in given.items() if value is not None}
    for name, field in kind.model_fields.items():
        if isinstance(found.get(name), str) and get_origin(field.annotation) is tuple:
            found[name] = tuple(listed(found[name]))
    return validate(kind, found)


def _paths(table: Mapping[str, Any], prefix: str = "") -> Iterator[tuple[str, Any]]:
    """Values by path, whether written as one quoted key or as nested tables; "usual" is no range, and a table that
    names a foot is of pulses."""
    for key, value in table.items():
        if isinstance(value, Mapping) and "foot" not in value:
            yield from _paths(value, f"{prefix}{key}.")
        else:
            yield f"{prefix}{key}", None if value == "usual" else value


def settings_text(design: str) -> str:
    """A TOML file with all settings of a design (landing, gait, adapt or leg) and what they are for; those without a
    default are commented out. Raises InputError for another design."""
    if design not in _KINDS:
        raise InputError(f"design: there is none called '{design}'{nearest(design, _KINDS)}")
    module, name = _KINDS[design]
    kind: type[Settings] = getattr(import_module(f"tarsus.design.{module}"), name)
    units = quantity_units(kind)

    def line(section: str, name: str) -> str:
        field = kind.model_fields[name]
        default = field.default
        word = "of" if name == section else name
        said = f"  # {field.description}"
        if field.is_required() or default is None:
            return f"# {word} ={said}"
        if name in units and units[name] != "1":
            return f'{word} = "{format_quantity(default, units[name])}"{said}'
        return f"{word} = {_toml(default)}{said}"

    sectioned = {name for names in kind.SECTIONS.values() for name in names}
    lines = [line("", name) for name in kind.model_fields if name not in sectioned and name not in BY_PATH]
    for name, example in BY_PATH.items():
        if name in kind.model_fields and get_origin(kind.model_fields[name].annotation) is not tuple:
            lines += ["", f"[{name}]", f"# {kind.model_fields[name].description}", f"# {example}"]
    for section, names in kind.SECTIONS.items():
        lines += ["", f"[{section}]", *(line(section, name) for name in names if name not in BY_PATH)]
    return "\n".join(lines) + "\n"


def _toml(value: Any) -> str:
    value = value.value if isinstance(value, Enum) else value
    if isinstance(value, (tuple, list)):
        return f"[{', '.join(map(_toml, value))}]"
    return f'"{value}"' if isinstance(value, str) else str(value)


def bearing(
    problems: Problems, scene: Scene, given: Any, risk: Any, designed: Callable[[str], bool]
) -> tuple[Over | None, Risk]:
    """Grounds and risk of a request, with what is wrong with them among its problems.

    ``designed`` says which paths the design itself chooses.
    """
    over = problems.tried(lambda: over_of(scene, given))
    problems += [
        f"{path}: is designed, so it cannot be part of the ground"
        for path in (over.names if over is not None else ())
        if designed(path)
    ]
    if risk is None:
        return over, NOMINAL if over is None else WORST
    found = problems.tried(lambda: risk_of(risk)) or NOMINAL
    if not given and found is not NOMINAL:
        problems.append(f"risk: '{found.name}' needs grounds to be judged on: name them under over")
    return over, found
