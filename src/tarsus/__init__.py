"""Tarsus: contact dynamics of legged piezoelectric micro-robots.

Names are loaded when first used, so that ``import tarsus`` is light.
"""

from __future__ import annotations

from importlib import import_module

from tarsus.base import moved

TYPE_CHECKING = False  # not imported: `typing` is half of what this module would load
if TYPE_CHECKING:
    from typing import Any

    from tarsus import design, fit, identify, impacts, measure, modes, synthesis
    from tarsus.base.errors import InputError
    from tarsus.base.spec import float_paths, get_value, quantity, with_values
    from tarsus.calibrate.calibrating import calibrate
    from tarsus.calibrate.mixture import load_mixture
    from tarsus.cluster.verb import sweep
    from tarsus.files.library import device_names, load_scene
    from tarsus.files.toml import read_scene, write_scene
    from tarsus.model.drive.amplifier import Amplifier
    from tarsus.model.drive.gait import Alternating, CustomGait, MetachronalGait, Ripple, Tripod
    from tarsus.model.drive.laws import Cubic, LinearForce, PrandtlIshlinskii, TwoBranch
    from tarsus.model.drive.waveforms import (
        Constant,
        OnOff,
        Poling,
        Ramp,
        RampedSquare,
        Sampled,
        Sine,
        Square,
        SweptSine,
    )
    from tarsus.model.laws import (
        Adhesion,
        AdhesionLaw,
        AdhesiveFriction,
        CaptureUnlessPulled,
        DampingLaw,
        DominantMode,
        Electrostatic,
        Film,
        Friction,
        FrictionLaw,
        Gravity,
        ImpactLaw,
        LegElectrostatic,
        MassWeighted,
        MeasuredImpactMap,
        PullAsPrinted,
        RestituteFirst,
        Restitution,
        SmoothLaw,
        load_laws,
    )
    from tarsus.model.robot import Drive, Foot, ModalLoad, PointLoad, Robot
    from tarsus.model.scene import Ground, Initial, Scene
    from tarsus.model.structure import Beam, Lumped, Modal, Walker, WalkerBody, WalkerLeg
    from tarsus.orbits import Branch, Orbit, branch, periodic
    from tarsus.records.readers import read_measurement
    from tarsus.report import plot, write_report
    from tarsus.solve import (
        Accuracy,
        Batch,
        Gradient,
        GradientBatch,
        GradientRun,
        Run,
        Session,
        gradient,
        simulate,
        simulate_batch,
    )

__all__ = [
    "Accuracy",
    "Adhesion",
    "AdhesionLaw",
    "AdhesiveFriction",
    "Alternating",
    "Amplifier",
    "Batch",
    "Beam",
    "Branch",
    "CaptureUnlessPulled",
    "Constant",
    "Cubic",
    "CustomGait",
    "DampingLaw",
    "DominantMode",
    "Drive",
    "Electrostatic",
    "Film",
    "Foot",
    "Friction",
    "FrictionLaw",
    "Gradient",
    "GradientBatch",
    "GradientRun",
    "Gravity",
    "Ground",
    "ImpactLaw",
    "Initial",
    "InputError",
    "LegElectrostatic",
    "LinearForce",
    "Lumped",
    "MassWeighted",
    "MeasuredImpactMap",
    "MetachronalGait",
    "Modal",
    "ModalLoad",
    "OnOff",
    "Orbit",
    "PointLoad",
    "Poling",
    "PrandtlIshlinskii",
    "PullAsPrinted",
    "Ramp",
    "RampedSquare",
    "RestituteFirst",
    "Restitution",
    "Ripple",
    "Robot",
    "Run",
    "Sampled",
    "Scene",
    "Session",
    "Sine",
    "SmoothLaw",
    "Square",
    "SweptSine",
    "Tripod",
    "TwoBranch",
    "Walker",
    "WalkerBody",
    "WalkerLeg",
    "branch",
    "calibrate",
    "design",
    "device_names",
    "fit",
    "float_paths",
    "get_value",
    "gradient",
    "identify",
    "impacts",
    "load_laws",
    "load_mixture",
    "load_scene",
    "measure",
    "modes",
    "periodic",
    "plot",
    "quantity",
    "read_measurement",
    "read_scene",
    "simulate",
    "simulate_batch",
    "sweep",
    "synthesis",
    "with_values",
    "write_report",
    "write_scene",
]

_HOMES = {
    "tarsus.calibrate.calibrating": "calibrate",
    "tarsus.calibrate.mixture": "load_mixture",
    "tarsus.cluster.verb": "sweep",
    "tarsus.model.drive.gait": "Alternating CustomGait Ripple Tripod MetachronalGait",
    "tarsus.model.drive.amplifier": "Amplifier",
    "tarsus.model.drive.laws": "Cubic LinearForce PrandtlIshlinskii TwoBranch",
    "tarsus.model.drive.waveforms": "Constant OnOff Poling Ramp RampedSquare Sampled Sine Square SweptSine",
    "tarsus.base.errors": "InputError",
    "tarsus.files.library": "device_names load_scene",
    "tarsus.files.toml": "read_scene write_scene",
    "tarsus.model.laws": (
        "Adhesion AdhesionLaw AdhesiveFriction CaptureUnlessPulled DampingLaw DominantMode Electrostatic "
        "Film Friction FrictionLaw Gravity ImpactLaw LegElectrostatic MassWeighted MeasuredImpactMap PullAsPrinted "
        "RestituteFirst Restitution SmoothLaw load_laws"
    ),
    "tarsus.model.robot": "Drive Foot ModalLoad PointLoad Robot",
    "tarsus.model.scene": "Ground Initial Scene",
    "tarsus.orbits": "Branch Orbit branch periodic",
    "tarsus.records.readers": "read_measurement",
    "tarsus.report": "write_report",
    "tarsus.solve": "Accuracy Batch Gradient GradientBatch GradientRun Run Session gradient simulate simulate_batch",
    "tarsus.base.spec": "float_paths get_value quantity with_values",
    "tarsus.model.structure": "Beam Lumped Modal Walker WalkerBody WalkerLeg",
}
_MODULES = {
    "plot": "tarsus.report.plot",
    **{
        name: f"tarsus.{name}"
        for name in ("design", "fit", "identify", "impacts", "measure", "modes", "synthesis")
    },
}
_HOME = {name: module for module, names in _HOMES.items() for name in names.split()}


moved.install()


_RENAMED = {
    "Free": "CustomGait",
    "Given": "MeasuredImpactMap",
    "LatchLaw": "AdhesionLaw",
    "ResistiveLaw": "DampingLaw",
    "Wave": "MetachronalGait",
}
"""Names of earlier versions, which still work and warn."""


def __getattr__(name: str) -> Any:
    if name in _RENAMED:
        return moved.renamed("tarsus", name, _RENAMED[name])
    if name == "__version__":
        from importlib.metadata import version

        return version("tarsus")
    if name in _MODULES:
        return import_module(_MODULES[name])
    if name not in _HOME:
        from tarsus.base.messages import nearest

        raise AttributeError(f"module 'tarsus' has no attribute '{name}'{nearest(name, __all__)}")
    value = getattr(import_module(_HOME[name]), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted([*globals(), *__all__, "__version__"])
