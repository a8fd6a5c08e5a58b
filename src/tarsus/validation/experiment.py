"""An experiment: a folder with the device, the measured rows, the study, the claims and notes."""

from __future__ import annotations

import os
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from tarsus.base.errors import InputError
from tarsus.base.messages import nearest
from tarsus.base.spec import get_value, validate
from tarsus.files.installed import is_path
from tarsus.files.library import load_scene
from tarsus.files.tables import read_table, read_text
from tarsus.model.laws import load_laws
from tarsus.validation.claims import Claims
from tarsus.validation.measured import MeasuredRows, read_measured
from tarsus.validation.selection import Selection
from tarsus.validation.studyfile import RowStudy, read_study

if TYPE_CHECKING:
    from tarsus.model.scene import Scene

MEASURED, STUDY, CLAIMS, NOTES, LAWS = "measured.csv", "study.py", "claims.toml", "notes.md", "laws.py"
"""Files of an experiment's folder; that of laws may be left out."""

_PACKAGED = Path(__file__).parents[1] / "data" / "validation"


@dataclass(frozen=True)
class PublishedExperiment:
    """What a folder holds: its name, the device with the provenance of its numbers, rows, study, claims, notes."""

    name: str
    folder: Path
    device: Scene
    measured: MeasuredRows
    study: RowStudy
    claims: Claims
    notes: str


def experiment_names() -> list[str]:
    """Names of the packaged experiments, in alphabetical order."""
    return sorted(file.parent.name for file in _PACKAGED.glob(f"*/{CLAIMS}"))


def load_experiment(name: str | os.PathLike[str]) -> PublishedExperiment:
    """A packaged experiment by name, or that of a folder.

    Raises InputError with every problem of its files.
    """
    text = os.fspath(name)
    folder = _PACKAGED / text if text in experiment_names() else Path(text)
    if not (folder / CLAIMS).is_file():
        known = experiment_names()
        what = f"the folder holds no {CLAIMS}" if folder.is_dir() else "there is no such experiment, and no such folder"
        raise InputError(f"'{text}': {what}{nearest(text, known)}")
    file = folder / CLAIMS
    claims = validate(Claims, read_table(file), prefix=str(file))
    laws = load_laws(folder / LAWS) if (folder / LAWS).is_file() else None
    device = load_scene(folder / claims.device if is_path(claims.device) else claims.device, laws=laws)
    found = PublishedExperiment(
        folder.resolve().name,
        folder,
        device,
        read_measured(folder / MEASURED, claims.measured),
        read_study(folder / STUDY),
        claims,
        read_text(folder / NOTES),
    )
    problems = _problems(found)
    if problems:
        raise InputError(problems)
    return found


def _problems(one: PublishedExperiment) -> list[str]:
    """What of the claims the table and the device do not have."""
    file = one.folder / CLAIMS
    problems = [
        f"{file}: claims.{name}.rows: {sentence}"
        for name, claim in one.claims.claims.items()
        for sentence in Selection(claim.rows).check(one.measured.columns)
    ]
    for path in one.claims.parameters.fitted:
        try:
            get_value(one.device, path)
        except InputError as error:
            problems += [f"{file}: parameters.fitted: {problem}" for problem in error.problems]
    return problems
