"""What the file of a study, a calibration, a campaign or a published experiment describes."""

from __future__ import annotations

from typing import TYPE_CHECKING

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
    return View(data, Table(title, ("varies", "values", "from", "to"), rows, [scored]))


def calibration_view(described: Described) -> View:
    """The unknowns of a calibration and their bounds, as the study writes them."""
    study = described.study
    rows = [(name, str(one.low), str(one.high)) for name, one in study.unknowns.items()]
    data = {"unknowns": {name: {"low": low, "high": high} for name, low, high in rows}}
    return View(data, Table(f"{len(rows)} unknowns", ("unknown", "from", "to"), rows))


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
    sets = f"{len(rows)} set{'s' * (len(rows) != 1)} of records"
    return View(data, Table(f"{campaign.name}: {campaign.device}, {sets}", columns, rows))


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
