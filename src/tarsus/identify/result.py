"""What an identification found, and what it leaves behind: a device that can be simulated, and numbers as tables."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from tarsus.base.spec import FrozenDict, float_paths, with_values
from tarsus.files.draws import Reliance, write_draws
from tarsus.files.jsontext import json_text
from tarsus.files.toml import scene_text
from tarsus.files.version import package_version
from tarsus.files.whole import write_text
from tarsus.identify.assessment import assessed
from tarsus.identify.step import NotDone, StepResult
from tarsus.identify.tables import checks_of, checks_table, identification_table, open_table, words_of
from tarsus.identify.verdict import Assessment
from tarsus.identify.walk_prediction import reliance_of
from tarsus.model.scene import Provenance, Scene, Source
from tarsus.records.excluded import Excluded
from tarsus.tables.table import Table, Tabled

if TYPE_CHECKING:
    from tarsus.identify.campaign import Opened, RecordFile
    from tarsus.identify.estimates import Estimates
    from tarsus.identify.film import FilmFit
    from tarsus.identify.foot import FootModel
    from tarsus.identify.heldout import Comparison
    from tarsus.identify.landing import LandingVerdict
    from tarsus.identify.resonance import Resonances

RESULT_FILES = ("identified.toml", "identification.json", "draws.npz", "report.html")
"""Everything that an identification leaves in its folder, with its report."""


@dataclass(frozen=True, repr=False)
class Identification(Tabled):
    """Everything that a campaign determines.

    opened: the campaign; readings: every file; left_out: data not used, with reasons; steps: results by name; not_done;
    known: all parameters, with draws; level: of the contact from the rest, with its standard error [m]; resonances:
    the modal fit; film: the detachments; landing: what records say of the landing rule, None where it is assumed;
    comparisons: held-out records; files_used: of how many files something was used; remarks; seconds.
    """

    opened: Opened
    readings: tuple[RecordFile, ...]
    left_out: tuple[Excluded, ...]
    steps: dict[str, StepResult]
    not_done: tuple[NotDone, ...]
    known: Estimates
    level: tuple[float, float] | None
    resonances: Resonances | None
    film: FilmFit | None
    landing: LandingVerdict | None
    comparisons: tuple[Comparison, ...]
    files_used: int
    remarks: tuple[str, ...]
    seconds: float

    def table(self) -> Table:
        """Every number with its interval and verdict, and what the data were used for."""
        return identification_table(self)

    def to_dict(self) -> dict[str, Any]:
        """Everything found as plain data."""
        return summary_of(self)

    def __repr__(self) -> str:
        numbers = sum(len(step.paths) for step in self.steps.values())
        return f"<Identification of '{self.opened.campaign.name}': {numbers} numbers in {len(self.steps)} steps>"

    @property
    def model(self) -> FootModel:
        """The device as identified."""
        return self.known.model()

    @property
    def reliance(self) -> Reliance:
        """How far its draws can be relied on."""
        return reliance_of(checks_of(self))


def identified_device(found: Identification) -> Scene:
    """The device with every number found, marked as calibrated, with its interval.

    What was not identified keeps its value and where it came from.
    """
    scene = found.model.scene
    units = float_paths(scene)
    origins = dict(scene.provenance)
    changed: dict[str, Provenance] = {}
    for step in found.steps.values():
        for path in step.paths:
            low, high = step.interval(path)
            value = units[path].value
            ends = (min(low, value), max(high, value)) if np.isfinite([low, high]).all() else None
            note = f"tarsus identify: {_note(step, found)}."
            source = Source.CALIBRATED
            if path in step.taken:
                source, note = Source.ASSUMED, "No record determines it; goes with the other numbers of its law."
            changed[path] = Provenance(source=source, note=note, interval=None if ends is None else (ends,))
    if found.landing is not None and found.landing.decided:
        note = f"tarsus identify: {found.landing.sentences()[0]}."
        changed["ground.landing"] = Provenance(source=Source.CALIBRATED, note=note)
    parents = {path.rpartition(".")[0] for path in changed}
    spread: dict[str, Provenance] = {}
    origins = {path: origin for path, origin in origins.items() if not path.startswith("ground.landing.")}
    for path, origin in origins.items():
        inside = [one for one in units if one.startswith(f"{path}.")]
        if path in parents and any(one in changed for one in inside):
            # a list of which only some numbers were found: the others keep their origin, one by one
            plain = origin.model_copy(update={"interval": None})
            spread |= {one: plain for one in inside if one not in changed}
        elif path not in changed:
            spread[path] = origin
    return with_values(scene, {"provenance": FrozenDict(spread | changed)})


def _note(step: StepResult, found: Identification) -> str:
    used = "; ".join(str(one) for one in step.used)
    return f"{step.records or step.name} of '{found.opened.campaign.name}', {used}"


def summary_of(found: Identification) -> dict[str, Any]:
    """Everything found as plain tables, for JSON and for tests."""
    judged, words = assessed(found), words_of(found)
    return {
        "campaign": found.opened.campaign.name,
        "seconds": found.seconds,
        "steps": {name: _step(step, judged, words) for name, step in found.steps.items()},
        "correlation": None if judged is None else {"paths": list(judged.names), "matrix": judged.correlation.tolist()},
        "not_done": {one.name: list(one.reasons) for one in found.not_done},
        "files": {"read": len(found.readings), "used": found.files_used},
        "remarks": list(found.remarks),
        "open": _rows(open_table(found)),
        "checks": _rows(checks_table(checks_of(found))),
        "landing": None if found.landing is None else _landing(found.landing),
        "left_out": [str(one) for one in found.left_out],
        "validation": [
            {"name": one.name, "file": one.file, "off": one.off, "over_noise": one.over} for one in found.comparisons
        ],
    }


def _rows(table: Table) -> list[dict[str, Any]]:
    """The rows of a table by the names of its columns."""
    names = [one.name for one in table.columns]
    return [dict(zip(names, row, strict=True)) for row in table.rows]


def _step(step: StepResult, judged: Assessment | None, words: Mapping[str, str]) -> dict[str, Any]:
    sentences = {} if judged is None else dict(zip(judged.names, judged.sentences(), strict=True))
    return {
        "parameters": {
            path: {
                "value": float(value),
                "interval": list(step.interval(path)),
                "verdict": words[path],
                **({"sentence": sentences[path]} if path in sentences else {}),
            }
            for path, value in zip(step.paths, step.values, strict=True)
        },
        "combinations": {
            name: {"value": value, "unit": unit, "interval": np.quantile(draws, [0.025, 0.975]).tolist()}
            for name, (value, draws, unit) in step.combinations.items()
        },
        "used": [str(one) for one in step.used],
        "left_out": step.unused,
        "notes": list(step.notes),
    }


def _landing(found: LandingVerdict) -> dict[str, Any]:
    return {
        "assumed": found.assumed.model_dump(),
        "chosen": found.chosen.model_dump(),
        "decided": found.decided,
        "sets": list(found.sets),
        "rules": [
            {"rule": one.rule.model_dump(), "off": one.off.tolist(), "contradicted_by": count}
            for one, count in zip(found.fits, found.contradicted, strict=True)
        ],
        "sentences": found.sentences(),
    }


def write_identification(found: Identification, folder: Path) -> list[Path]:
    """Write identified.toml, identification.json and draws.npz into a folder, and return their paths.

    Raises
    ------
    InputError
        If the folder cannot be written.
    """
    folder.mkdir(parents=True, exist_ok=True)
    device, numbers, draws = (folder / name for name in RESULT_FILES[:3])
    write_text(device, scene_text(identified_device(found)))
    write_text(numbers, json_text(summary_of(found) | {"tarsus": package_version()}) + "\n")
    write_draws(draws, found.known.paths, found.known.values, found.known.samples, found.reliance)
    return [device, numbers, draws]
