"""The verbs: a row for each that is a function of the library. What a row means is said in `tarsus.cli.verb`."""

from __future__ import annotations

from importlib import import_module
from typing import Any

from tarsus.cli.declared import Declaration
from tarsus.cli.verb import Verb

COMMANDS: dict[str, Verb] = {
    "devices": Verb("tarsus.inspection.installation:devices", words=0),
    "show": Verb("tarsus.inspection.show:show", words=2),
    "new": Verb("tarsus.inspection.begin:new", words=2),
    "check": Verb("tarsus.inspection.show:check"),
    "simulate": Verb(
        "tarsus.solve.simulation:simulate",
        files="tarsus.files.store:RUN_FILES",
        page="tarsus.report.run_page:write_report",
        own=True,
    ),
    "explore": Verb(
        "tarsus.report.explorer:explore",
        endings="tarsus.report.explorer:ENDINGS",
        title="making the explorer",
        own=True,
    ),
    "report": Verb("tarsus.report.verb:report", title="writing the report", own=True),
    "plot": Verb("tarsus.report.plot:plot", words=2, endings="tarsus.report.saved:FORMATS", title="drawing"),
    "movie": Verb("tarsus.report.movie:movie", endings="tarsus.report.movie:ENDINGS", title="simulating and drawing"),
    "sweep": Verb(
        "tarsus.cluster.verb:sweep",
        files="tarsus.files.runstore:SWEEP_FILES",
        page="tarsus.report.verb:write_sweep_page",
        folder=".sweep",
        own=True,
    ),
    "yield": Verb(
        "tarsus.study.yields:yield_",
        files="tarsus.study.yields:YIELD_FILES",
        page="tarsus.report.yield_page:yield_html",
        folder=".yield",
        title="robots, legs",
    ),
    "branch": Verb(
        "tarsus.orbits.branching:branch",
        files="tarsus.orbits.files:BRANCH_FILES",
        write="tarsus.orbits.files:write_branch",
        page="tarsus.report.branch_page:branch_html",
        title="following motions",
    ),
    "attractors": Verb(
        "tarsus.orbits.attractors:attractors",
        files="tarsus.orbits.files:ATTRACTOR_FILES",
        write="tarsus.orbits.files:write_attractors",
        page="tarsus.report.attractors_page:write_pages",
        title="attractors",
    ),
    "atlas": Verb(
        "tarsus.atlas.verb:atlas",
        files="tarsus.atlas.verb:FILES",
        write="tarsus.atlas.result:Atlas.write",
        page="tarsus.report.atlas_page:atlas_html",
    ),
    "synthesize": Verb(
        "tarsus.synthesis.verb:synthesize", files="tarsus.synthesis.campaign_folder:CAMPAIGN_FILES", title="records"
    ),
    "identify": Verb(
        "tarsus.identify.verb:identify",
        files="tarsus.cli.identify:FILES",
        page="tarsus.report.track_page:identified_html",
        title="steps",
        own=True,
    ),
    "modes": Verb(
        "tarsus.modes.verb:modes",
        files="tarsus.modes.writing:MODES_FILES",
        page="tarsus.report.modes_page:modes_html",
        title="identifying",
        own=True,
    ),
    "calibrate": Verb(
        "tarsus.calibrate.calibrating:calibrate",
        files="tarsus.calibrate.writing:CALIBRATION_FILES",
        page="tarsus.report.calibrate_page:calibration_html",
        folder=".calibration",
        title="sets",
    ),
    "validate": Verb(
        "tarsus.validation.verb:validate",
        files="tarsus.report.validation_page:FILES",
        write="tarsus.report.validation_page:write_validation",
        page="tarsus.report.validation_page:write_pages",
        title="comparing",
        own=True,
    ),
    "recommend": Verb("tarsus.synthesis.recommend:recommend", title="records", own=True),
    "export": Verb("tarsus.export.verb:export", files="tarsus.export.verb:FILES", title="writing and measuring"),
    "bench": Verb("tarsus.study.bench:bench", words=0, title="timing"),
    "doctor": Verb("tarsus.inspection.installation:doctor", words=0),
}

PLAIN = ("design", "completion")
"""Verbs that only the command line has in this form; each is in the file of its name."""

VERBS = (*COMMANDS, *PLAIN)
"""All of them."""


def declared(verb: str) -> Declaration:
    """The function of a verb, or what its file says of it."""
    return COMMANDS[verb].declared if verb in COMMANDS else Declaration(f"tarsus.cli.{verb}:{verb}")


def line_of(verb: str) -> Any:
    """What cyclopts takes of a verb."""
    if verb not in COMMANDS:
        return getattr(import_module(f"tarsus.cli.{verb}"), verb)
    from tarsus.cli import line

    return line.line_of(COMMANDS[verb], verb)
