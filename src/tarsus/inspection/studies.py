"""What the file of a study, a calibration, a campaign or a published experiment describes."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from tarsus.base.plausible import remarks
from tarsus.files.library import load_scene
from tarsus.tables.numbers import how_many
from tarsus.tables.table import Column, Table
from tarsus.tables.view import View

if TYPE_CHECKING:
    from tarsus.calibrate.studyfile import Described
    from tarsus.identify.campaign import Opened
    from tarsus.study.sweep import Sweep
    from tarsus.validation import PublishedExperiment


def study_view(study: Sweep) -> View:
    """What varies in a study, over which values, and what its runs are scored by."""
    axes = {name: axis.ends for name, axis in study.vary.items()}
    data = {
        "study": study.name,
        "scene": study.scene.name,
        "runs": study.runs,
        "duration_s": study.seconds,
        "motion": str(study.motion),
        "vary": {name: list(ends) for name, ends in axes.items()},
        "measures": list(study.measures),
    }
    rows = [(name, study.vary[name].kind, *ends) for name, ends in axes.items()]
    title = f"{study.name}: {study.runs} runs of {study.scene.name}, {study.motion}"
    scored = f"scored by {', '.join(study.measures)}"
    return View(data, Table(title, ("varies", "values", "from", "to"), rows, [scored]), tuple(remarks(study.scene)))


def calibration_view(described: Described) -> View:
    """The unknowns of a calibration and their bounds, as the study writes them. Raises InputError with all that is
    wrong with it."""
    from tarsus.calibrate.lowering import lower_study

    lower_study(described)
    study = described.study
    rows = [(name, str(one.low), str(one.high)) for name, one in study.unknowns.items()]
    data = {"unknowns": {name: {"low": low, "high": high} for name, low, high in rows}}
    return View(data, Table(f"{len(rows)} unknowns", ("unknown", "from", "to"), rows))


def design_view(name: str, laws: Mapping[str, Any]) -> View:
    """What a design file frees and wants. Raises InputError with all that is wrong with it."""
    from tarsus.base.errors import InputError
    from tarsus.design.problem import DesignSettings, problem_of
    from tarsus.design.request import settings_of

    options = settings_of(DesignSettings, name)
    if options.scene is None:
        raise InputError(f"{name}: scene: name a device or a scene file")
    asked = problem_of(load_scene(options.scene, laws=laws), options, options.risk)
    numbers, wanted = asked.free.numbers, [one.name for one in asked.objectives]
    rows = list(zip(numbers.names, *(ends.tolist() for ends in (numbers.low, numbers.high)), strict=True))
    data = {
        "scene": asked.scene.name,
        "free": list(asked.free.names),
        "objectives": wanted,
        "limits": [str(one) for one in asked.limits],
        "over": [] if asked.over is None else list(asked.over.names),
        "risk": asked.risk.name,
        "motion": str(asked.motion),
    }
    title = f"{name}: {asked.scene.name}, {' and '.join(wanted)} by {len(asked.free.names)} free numbers"
    return View(data, Table(title, ("free", "from", "to"), rows, [str(asked.motion)]))


def campaign_view(opened: Opened) -> View:
    """The sets of records of a campaign."""
    campaign = opened.campaign
    rows = [(name, one.purpose.value, len(one.files), one.gap) for name, one in campaign.records.items()]
    data = {
        "campaign": campaign.name,
        "device": campaign.device,
        "sets": {name: {"purpose": why, "files": count, "gap_m": gap} for name, why, count, gap in rows},
    }
    columns = ("records", "purpose", "files", Column("gap", "m"))
    title = f"{campaign.name}: {campaign.device}, {how_many(len(rows), 'set')} of records"
    return View(data, Table(title, columns, rows))


def experiment_view(one: PublishedExperiment) -> View:
    """The claims about a published experiment, whose files are all good."""
    claims = one.claims.claims
    data = {
        "experiment": one.name,
        "rows": len(one.measured),
        "measured": list(one.claims.measured),
        "claims": {name: {"of": one.claims.column_of(claim), "where": claim.rows} for name, claim in claims.items()},
        "cite": one.claims.source.cite,
    }
    rows = [
        (name, one.claims.measured[one.claims.column_of(claim)].words, claim.rows or "all", claim.seen.value)
        for name, claim in claims.items()
    ]
    title = f"{one.name}: {one.claims.title}, {len(one.measured)} rows, {len(claims)} claims"
    return View(data, Table(title, ("claim", "of", "rows where", "seen"), rows, (one.claims.source.cite,)))
