"""A unit of FMI 3.0 for co-simulation: a stepped robot, with the volts of its drives as inputs."""

from __future__ import annotations

from html import escape
from importlib.metadata import version
from importlib.resources import as_file, files
from importlib.util import find_spec
from pathlib import Path
from tempfile import TemporaryDirectory

from tarsus.base.errors import InputError
from tarsus.export.subject import Subject
from tarsus.export.verb import Exported
from tarsus.files.jsontext import json_text
from tarsus.files.toml import scene_texts
from tarsus.files.whole import write_text

STEP = 1e-3
"""Communication step [s] that the unit proposes, unless another is asked for."""

LOST = (
    "signals and gait of the scene: every drive has the volts of its input, held over each step",
    "when events were: outputs are those at the ends of steps",
)


def exported(described: Subject, step: float | None) -> Exported:
    """``robot.fmu``; step [s]: the communication step that it proposes. Raises InputError where pythonfmu3 is not
    installed, and where two law files have one name."""
    if find_spec("pythonfmu3") is None:
        raise InputError("fmu: pythonfmu3 is not installed (pip install pythonfmu3)")
    from pythonfmu3 import FmuBuilder

    proposed = {"stop_time": described.run.duration, "step_size": STEP if step is None else step}
    texts = {**scene_texts(described.scene), "experiment.json": json_text(proposed)}
    needs = f"the Python of the process that loads the unit, with tarsus {version('tarsus')} (pip install tarsus)."
    pages = {"externalDependencies.txt": f"Needs {needs}", "index.html": _page(described.scene.name, needs)}
    with TemporaryDirectory() as made, as_file(files("tarsus.export") / "fmu_slave.py") as slave:
        folder = Path(made)
        for name, text in texts.items():
            write_text(folder / "resources" / name, text)
        for name, text in pages.items():
            write_text(folder / "documentation" / name, f"{text}\n")
        unit = FmuBuilder.build_FMU(
            slave,
            folder,
            sorted((folder / "resources").iterdir()),
            folder / "documentation",
            canHandleVariableCommunicationStepSize=True,
            canGetAndSetFMUState=True,
        )
        return Exported.listed({unit.name: unit.read_bytes()}, LOST)


def _page(name: str, needs: str) -> str:
    """The page that the standard asks for."""
    said = "".join(f"<li>{escape(one)}" for one in LOST)
    return (
        f'<!DOCTYPE html><html lang="en"><meta charset="utf-8"><title>{escape(name)}</title><h1>{escape(name)}</h1>'
        f"<p>A robot of Tarsus, exact from event to event. Needs {escape(needs)}"
        "<p>Inputs: volts of the drives. Parameters: numbers of the ground and gaps at rest, in SI units. Outputs: "
        "gaps, whether feet are on the ground and slip, displacements of points, the body's place, how the last step "
        f"ended (0: it reached its end).<p>Without a counterpart:<ul>{said}</ul></html>"
    )
