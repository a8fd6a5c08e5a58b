"""Wrong inputs of scenes: structures, drives, grounds, laws, gaits, files and devices."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

import tarsus as ts
import wrong_inputs
from printed_robots import POINTS, hexapod, printed_map
from scene_files import creeping as creeping_scene
from scene_files import scene as scene_of
from tarsus.base.spec import Description, validate, with_values
from tarsus.export.subject import Subject
from tarsus.files.library import load_scene
from tarsus.files.toml import read_scene
from tarsus.model.drive.gait import Alternating
from tarsus.model.drive.laws import Creeping, LinearForce, TwoBranch
from tarsus.model.drive.laws.prandtl_ishlinskii import PrandtlIshlinskii, fit_branches
from tarsus.model.drive.lower import lower
from tarsus.model.drive.waveforms import Sampled, Sine, Square, SweptSine, Waveform
from tarsus.model.laws import Adhesion, Electrostatic, Film, Friction, Restitution
from tarsus.model.laws.impact_map import DominantMode, MeasuredImpactMap
from tarsus.model.scene import Ground, Scene
from tarsus.model.structure import Beam, Lumped, Modal, Payload, Walker
from tarsus.model.structure.leg_motion import step_response
from tarsus.solve.packet import packet_of
from tarsus_reproduce.legs import millipede_leg
from walking_scenes import trotter
from wrong_inputs import Ask, Said, written

Rows = dict[str, tuple[Ask, Said]]


class Holder(Description):
    """A signal in a file."""

    signal: Waveform


def changed(of: str | Scene, **values: Any) -> Ask:
    """A device, or a scene, with other values; `__` stands for the dots of a path."""
    return lambda at: with_values(
        load_scene(of) if isinstance(of, str) else of, {path.replace("__", "."): one for path, one in values.items()}
    )


def made(of: Callable[..., Any], **fields: Any) -> Ask:
    return lambda at: of(**fields)


TWO = {"coordinates": ["tip", "base"], "mass": ["1 mg", "2 mg"], "stiffness": [[2.0, -2.0], [-2.0, 5.0]]}
STRIP = {
    "frequencies": ["623 Hz", "6424 Hz"],
    "damping_ratios": [0.02, 0.02],
    "length": "750 um",
    "tip_length": "150 um",
    "tip_width": "100 um",
    "tip_thickness": "10 um",
    "tip_density": "2330 kg/m^3",
}


def lumped(**changes: Any) -> Ask:
    return lambda at: Lumped(**{**TWO, **changes})


def beam(**changes: Any) -> Ask:
    return lambda at: Beam(**{**STRIP, **changes})


def walker(_body: dict[str, Any] | None = None, **legs: dict[str, Any]) -> Ask:
    leg = {"mass": "1 ug", "stiffness_v": 1.2, "damping_v": 1e-3, "stiffness_l": 0.7, "damping_l": 2e-4}
    return made(Walker, body=_body or {"mass": 1.0}, legs={name: leg | own for name, own in legs.items()})


MODAL = {"damping_ratios": 1, "modal_masses": 3, "shapes.a": 1}
NO_INERTIA = "mass: the mass matrix is singular: some motion has no inertia"
STRUCTURES: Rows = {
    "mass that is no number": (lumped(mass=[math.nan, 1.0]), "mass.0.0: expected a mass (kg) that is finite, got nan"),
    "negative mass": (
        lumped(mass=["-1 mg", "2 mg"]),
        "mass.0.0: expected a mass (kg) above 0, got -1e-06: a mass is never negative",
    ),
    "no mass": (lumped(mass=[0.0, 1.0]), NO_INERTIA),
    "singular mass": (lumped(mass=[[1.0, 1.0], [1.0, 1.0]]), NO_INERTIA),
    "indefinite mass": (lumped(mass=[[1.0, 2.0], [2.0, 1.0]]), "mass: the mass matrix is not positive definite"),
    "asymmetric mass": (lumped(mass=[[1.0, 0.1], [0.2, 1.0]]), "mass: the mass matrix must be symmetric"),
    "one mass": (lumped(mass=[1.0]), "mass: expected a 2 x 2 matrix, one row a coordinate, got 1 x 1"),
    "one row": (lumped(stiffness=[[1.0, 2.0]]), "stiffness: expected a 2 x 2 matrix, one row a coordinate, got 1 x 2"),
    "unit of a mass": (lumped(mass=["1 m", "2 mg"]), "mass.0.0: expected a mass (kg), got '1 m', which is a length"),
    "damping twice": (
        lumped(damping=[0.0, 0.0], damping_ratios=[0.1, 0.1]),
        "give either a damping matrix or damping_ratios",
    ),
    "one ratio": (lumped(damping_ratios=[0.1]), "damping_ratios: expected 2 values, one a coordinate, got 1"),
    "point of a coordinate's name": (
        lumped(weights={"tip": [1.0, 0.0]}),
        "weights.tip: this name is already that of a coordinate",
    ),
    "one coordinate twice": (
        lumped(coordinates=["tip", "tip"]),
        "coordinates: expected different names, got one twice",
    ),
    "lengths of modes": (
        made(Modal, frequencies=[1.0, 2.0], damping_ratios=[0.1], modal_masses=[1.0] * 3, shapes={"a": [1.0]}),
        [f"Modal.{of}: expected 2 values, one a mode, got {n}" for of, n in MODAL.items()],
    ),
    "combination as a coordinate": (
        lambda at: Lumped(**TWO, weights={"mid": [0.5, 0.5]}).alone("mid"),
        "'mid' is a combination",
    ),
    "hip as a coordinate": (
        lambda at: load_scene("millipede").robot.structure.alone("L1_hip"),
        "no coordinate of a walker",
    ),
    "numbers of a walker": (
        walker({"mass": 0.0, "roll_inertia": -1e-12}, a={"mass": "0 ug", "stiffness_l": -1.0}),
        ["Walker.body.mass: ", "Walker.body.roll_inertia: ", "Walker.legs.a.mass: ", "Walker.legs.a.stiffness_l: "],
    ),
    "no leg": (walker(), ["Walker.legs: ", "at least one leg"]),
    "leg of another's point": (walker(a={}, a_x={}), ["Walker.legs.a: its point 'a_x' ", "Walker.legs.a_x: "]),
    "leg of the body's name": (walker(body={}), "Walker.legs.body: its point 'body' would bear the name"),
    "misspelt field": (lumped(stifness=1.0), "stifness: unknown name 'stifness'; did you mean 'stiffness'?"),
    "beam, too stiff": (
        beam(frequencies=[623.0, 30000.0]),
        "frequencies: with this tip the second frequency is at most 26.6",
    ),
    "beam, too soft": (
        beam(frequencies=[623.0, 1500.0]),
        "frequencies: with this tip the second frequency is at least ",
    ),
    "beam, backwards": (beam(frequencies=[623.0, 600.0]), "frequencies: the second frequency must be above the first"),
    "beam, one frequency": (beam(frequencies=[623.0]), "frequencies"),
    "beam, no ratio": (beam(damping_ratios=[]), "damping_ratios: expected at least one"),
    "beam, density": (beam(tip_density=-1.0), "tip_density: expected a density (kg/m^3) above 0, got -1.0"),
    "beam, unit": (beam(length="750 um^2"), "length: expected a length (m), got '750 um^2', which is an area"),
    "leg that leans back": (lambda at: with_values(millipede_leg().leg, {"shin.angle": -1.0}), "must be above it"),
    "leg that is straight": (
        lambda at: with_values(millipede_leg().leg, {"thigh.angle": np.pi / 2}).linearised(),
        "do not determine the joints",
    ),
    "leg that is too weak": (
        lambda at: step_response(with_values(millipede_leg().leg, {"body_mass": 1e-3}), [0.0, 0.01]),
        "folds under",
    ),
    "leg from late on": (lambda at: step_response(millipede_leg().leg, [0.01, 0.02]), "increases from 0"),
    "leg of no length": (lambda at: with_values(millipede_leg().leg, {"hip.length": -1e-4}), "above 0"),
}


DRIVE = {"load": {"kind": "point", "weights": {"base": 1.0}}, "law": {"kind": "linear", "gain": 1e-6}}
TOE = {"point": "tip", "gap": 7e-5}
CHAIN = {"structure": {"kind": "lumped", **TWO}, "drives": {"pzt": DRIVE}, "feet": {"toe": TOE}}


def loaded(**load: Any) -> Ask:
    """A robot whose drive has another load."""
    return made(ts.Robot, **CHAIN | {"drives": {"pzt": DRIVE | {"load": load}}})


def on_foot(**toe: Any) -> Ask:
    return made(ts.Robot, **CHAIN | {"feet": {"toe": TOE | toe}})


def placed(**scene: Any) -> Ask:
    return made(Scene, **{"name": "chain", "robot": CHAIN, "duration": 0.1} | scene)


FREE = {"frequencies": [0.0], "damping_ratios": [0.0], "modal_masses": [1.0], "shapes": {"tip": [1.0]}}
ROBOTS: Rows = {
    "load of no share": (loaded(kind="inertia"), "load: an inertia load needs a share"),
    "load of no way": (loaded(kind="inertia", forward=1.0), "load.forward: needs the structure's own 'forward'"),
    "point of a load": (loaded(kind="point", weights={"bas": 1.0}), "Robot.drives.pzt.load.weights.bas: "),
    "points of a load": (loaded(kind="point", weights={}), "Robot.drives.pzt.load.weights: "),
    "participation": (loaded(kind="modal", participation=[1.0]), "Robot.drives.pzt.load.participation: "),
    "point of a foot": (on_foot(point="tpi"), "Robot.feet.toe.point: "),
    "electrode": (on_foot(electrode="pzd"), "Robot.feet.toe.electrode: "),
    "foot below": (on_foot(gap="-3 um"), "below ground at rest"),
    "gap that is no number": (on_foot(gap=math.nan), "got nan"),
    "way of its own": (on_foot(along="tip"), "'tip' is the foot's own point"),
    "normal": (made(ts.Foot, point="tip", gap=0.0, normal=2), "Foot.normal: "),
    "signal of no drive": (placed(signals={"ptz": {"kind": "constant", "level": 1.0}}), "Scene.signals.ptz: "),
    "start of other sizes": (
        placed(initial={"displacement": [0.0], "velocity": [0.0]}),
        ["Scene.initial.displacement: ", "Scene.initial.velocity: "],
    ),
    "gravity of no way": (
        placed(robot={"structure": {"kind": "modal", **FREE}, "feet": {"toe": TOE}}, ground={"gravity": {}}),
        "Scene.robot.structure.upward: ",
    ),
    "electrostatics of no electrode": (
        placed(ground={"electrostatic": {"coefficient": 1e-21, "offset": 1e-6}}),
        "Scene.ground.electrostatic: acts on no foot",
    ),
}


def amplifier(**fields: Any) -> Ask:
    return changed("cantilever", robot__drives__pzt__amplifier=fields)


def signal(kind: str, **fields: Any) -> Ask:
    return lambda at: validate(Holder, {"signal": {"kind": kind, **fields}})


def recorded(name: str, content: str, *said: str) -> tuple[Ask, Said]:
    return written(content, name, lambda file: Sampled(file=str(file))), said


def creeping(**fields: Any) -> Creeping:
    law = {
        "instant": {"linear": 8e-7, "thresholds": [1.0, 2.0], "weights": [2e-7, 1e-7]},
        "thresholds": [0.0, 1.5],
        "weights": [1e-7, 2e-7],
        "times": [0.05, 3e-3],
        "temperature": 303.15,
        "per_kelvin": 4e-3,
    }
    return validate(Creeping, law | fields)


PLAYS = PrandtlIshlinskii(constant=0.3, linear=1.0, cubic=-0.0005, thresholds=(0.0, 0.5), weights=(0.1, 0.2))
PIEZO, CREEP = "robot.drives.pzt.amplifier", "robot.drives.pzt.law"
DRIVES: Rows = {
    "amplifier's field": (amplifier(slew_rat="10 V/ms"), (PIEZO, "did you mean 'slew_rate'")),
    "slew rate": (amplifier(slew_rate="-10 V/ms"), (PIEZO, "expected a rate of voltage (V/s) above 0, got -10 V/ms")),
    "unit of a slew rate": (amplifier(slew_rate="10 V"), (PIEZO, "V/s")),
    "bandwidth twice": (amplifier(bandwidth="1 kHz", rise_time="1 ms"), (PIEZO, "give one of the two")),
    "rails upside down": (
        amplifier(clip=["3 V", "-3 V"]),
        (PIEZO, "expected the lowest voltage before the highest, got 3 V and -3 V"),
    ),
    "one rail of nothing": (amplifier(clip="0 V"), (PIEZO, "expected a voltage (V) above 0 for both signs")),
    "unit of a rail": (amplifier(clip="3 m"), f"{PIEZO}.clip"),
    "sine, frequency": (
        signal("sine", amplitude=8, frequency=0),
        ("signal", "frequency: expected a frequency", "above 0"),
    ),
    "sine, amplitude": (signal("sine", amplitude=-8, frequency=5), ("signal", "amplitude: ", "of at least 0")),
    "sine, no number": (signal("sine", amplitude=math.nan, frequency=5), ("signal", "amplitude: ")),
    "sine, unit": (signal("sine", amplitude="8 um", frequency=5), ("signal", "amplitude: ", "length")),
    "sine, field": (signal("sine", amplitude=8, frequenzy=5, frequency=5), ("signal", "did you mean 'frequency'")),
    "sine, size": (made(Sine, amplitude=1.0, frequency=1e-310), "size from 1e-60 to 1e"),
    "square, duty": (signal("square", amplitude=8, frequency=5, duty=1.5), ("signal", "duty: ", "from 0 to 1")),
    "ramped square, duty": (
        signal("ramped_square", amplitude=8, frequency=5, duty=-0.1),
        ("signal", "duty: ", "from 0 to 1"),
    ),
    "ramp": (signal("ramp", stop=8, duration=0), ("signal", "duration: ", "above 0")),
    "sweep": (
        signal("swept_sine", amplitude=1, start_frequency=0, stop_frequency=9, duration=1),
        ("signal", "start_frequency: ", "above 0"),
    ),
    "sweep of too many cycles": (
        lambda at: lower(SweptSine(amplitude=1.0, start_frequency=1e6, stop_frequency=1e9, duration=10.0), LINE),
        "rises and falls about 1e+10 times",
    ),
    "pulses, lengths": (signal("on_off", levels=[1, 2], durations=[1]), ("signal", "durations: expected 2 durations")),
    "pulses, none": (signal("on_off", levels=[], durations=[]), ("signal", "levels: expected at least one")),
    "pulses, duration": (signal("on_off", levels=[1], durations=[0]), ("signal", "durations", "above 0")),
    "poling": (signal("poling", level=10, hold=1, fall=-1), ("signal", "fall: ", "of at least 0")),
    "samples, none": (signal("sampled"), ("signal", "expected either times and levels, or a file")),
    "samples and a file": (
        signal("sampled", times=[0, 1], levels=[0, 1], file="x.csv"),
        ("signal", "file: give either"),
    ),
    "samples at one time": (
        signal("sampled", times=[0, 1, 1], levels=[0, 1, 2]),
        ("signal", "times: sample times must increase"),
    ),
    "samples, one voltage": (
        signal("sampled", times=[0, 1], levels=[0]),
        ("signal", "times: expected as many times as voltages"),
    ),
    "one sample": (signal("sampled", times=[0], levels=[0]), ("signal", "times: expected at least two samples")),
    "start of samples": (made(Sampled, times=(0.0, 1.0), levels=(0.0, 1.0), start=1.0), "start: is of a file"),
    "kind of a signal": (
        signal("sinus", amplitude=8, frequency=5),
        ("signal", "unknown kind 'sinus'; did you mean 'sine'"),
    ),
    "samples that cross in a batch": (
        lambda at: ts.simulate_batch(
            scene_of("p1_n2", {"signals": {"pull": Sampled(times=(0.0, 0.1, 0.2), levels=(0.0, 8.0, 0.0))}}),
            {"signals.pull.times.1": [0.1, 0.19], "signals.pull.times.2": [0.3, 0.15]},
        ),
        "sample times must increase",
    ),
    "no file": (lambda at: Sampled(file=str(at / "none.csv")), "there is no file"),
    "a word": recorded(
        "b.csv", "0,1\n1,2\n2,fish\n", "b.csv, line 3: column 'column 2' has 'fish' where a number is expected"
    ),
    "no volts": recorded(
        "c.csv", "a,b,c\n0,1,2\n1,1,2\n", "c.csv has no column 'volts'; valid names are 'a', 'b', 'c'; name that"
    ),
    "times that go back": recorded("d.csv", "0,1\n2,1\n1,1\n", "2.0 s is followed by 1.0 s"),
    "no rows": recorded("e.csv", "\n", "e.csv holds no rows of numbers"),
    "no number": recorded("f.csv", "0,1\n1,nan\n2,1\n", "expected finite samples, got a NaN"),
    "column in mm/s": recorded(
        "g.csv", "time (s),drive (mm/s)\n0,1\n1,2\n", "column 'drive' is in 'mm/s', which is no unit of voltage"
    ),
    "column in furlongs": recorded(
        "k.csv", "time (s),drive (furlong)\n0,1\n1,2\n", "'furlong' is no unit of voltage; name the column"
    ),
    "two columns": recorded("h.csv", "time (s),a (V),b (V)\n0,1,1\n1,2,2\n", "h.csv has no column 'volts'"),
    "MATLAB's in name": recorded("i.mat", "not a mat file at all", "i.mat is no MATLAB file"),
    "cut": recorded(
        "j.csv", "Samples,4\ntime (s),drive (V)\n0,1\n1,2\n", "j.csv is truncated: channel 'drive' has 2 values"
    ),
    "plays, one weight": (
        made(PrandtlIshlinskii, linear=1.0, thresholds=(1.0, 2.0), weights=(1.0,)),
        ("weights: expected 2 weights", "got 1"),
    ),
    "plays, threshold": (
        made(PrandtlIshlinskii, linear=1.0, thresholds=(-1.0,), weights=(1.0,)),
        ("thresholds", "of at least 0"),
    ),
    "unit of a branch": (
        lambda at: validate(TwoBranch, {"rising": {"linear": "3 um"}, "falling": {}}),
        "rising.linear: ",
    ),
    "force out of reach": (lambda at: PLAYS.inverse([1.0, 100.0]), "force 2, 100.0 N, is out of reach"),
    "force out of limits": (lambda at: PLAYS.inverse([5.0], limits=(-1.0, 1.0)), "out of reach between -1 V and 1 V"),
    "force that is none": (lambda at: PLAYS.inverse([math.nan]), "out of reach"),
    "plays against the rest": (
        lambda at: PrandtlIshlinskii(linear=1.0, thresholds=(1.0, 2.0), weights=(-1.5, 1.0)).inverse([0.1]),
        "has no inverse",
    ),
    "a cubic alone": (lambda at: PrandtlIshlinskii(linear=0.0, cubic=1.0).inverse([0.1]), "has no inverse"),
    "branches backwards": (lambda at: fit_branches(abs, abs, (8.0, -8.0), 6), "span of two increasing"),
    "branches without plays": (lambda at: fit_branches(abs, abs, (-8.0, 8.0), 0), "at least one play"),
    "branches that are not finite": (
        lambda at: fit_branches(lambda v: np.full_like(v, np.nan), abs, (-8.0, 8.0), 4),
        "not finite",
    ),
    "history": (lambda at: lower(Sine(amplitude=1.0, frequency=1.0), PLAYS, [math.nan]), "history"),
    "creep, no weight": (
        lambda at: with_values(creeping(), {"thresholds": (1.0,), "times": (1.0,), "weights": ()}),
        "weights: expected 1 values",
    ),
    "creep, too cold": (lambda at: creeping(per_kelvin=-0.2), "leaves -"),
    "creep, too slow": (
        lambda at: lower(Square(amplitude=1.0, frequency=100.0), creeping(times=[1e5, 1.0])),
        "too slow, or too fast",
    ),
    "creep, times": (lambda at: creeping().along([0.0, 0.0], [1.0, 2.0]), "times that increase"),
    "creep, out of reach": (
        lambda at: creeping().inverse([0.0, 1.0], [0.0, 1.0], limits=(-20.0, 20.0)),
        "force 2, 1.0 N, is out of reach",
    ),
    "creep of each robot": (
        lambda at: ts.Session(creeping_scene(), robots=2, vary={f"{CREEP}.temperature": [290.0, 300.0]}).reset(),
        "has the same numbers in all robots",
    ),
    "creep, backwards": (lambda at: creeping(weights=[1e-7, -9e-7]).inverse([0.0], [0.0]), "pull against"),
    **{
        f"duty of {duty}": (
            made(Alternating, frequency=10.0, high="14 V", duty=duty),
            ("Alternating.duty: ", "above 0 and below 1"),
        )
        for duty in (0.0, 1.0, -0.2, 1.5)
    },
}
LINE = LinearForce(gain=1.0)


def feet(**grounds: Any) -> Ask:
    return lambda at: with_values(trotter(2), {"ground.profile": {"kind": "feet", "feet": grounds}})


def profile(kind: str, **fields: Any) -> Ask:
    return lambda at: validate(Ground, {"profile": {"kind": kind, **fields}})


def motion(device: str = "ball", **fields: Any) -> Ask:
    made_of = load_scene(device) if device in ("millipede", "hexapod") else scene_of(device)
    return changed(made_of, ground__motion=fields)


def impact(columns: dict[str, Any]) -> Ask:
    base = hexapod(signal=Square(amplitude=10.0, frequency=30.0), impact=printed_map())
    return lambda at: with_values(base, {"ground.impact": MeasuredImpactMap(columns=columns)})


def printed(**shapes: Any) -> Ask:
    """The pull as printed on a structure of two modes with these shapes."""
    modes = {"frequencies": (10.0, 20.0), "damping_ratios": (0.0, 0.0), "modal_masses": (1.0, 1.0), "shapes": shapes}
    robot = {"structure": {"kind": "modal", **modes}, "feet": {"foot": {"point": "foot", "gap": 1e-3}}}
    return made(Scene, name="two", robot=robot, duration=1.0, ground={"landing": {"kind": "pull_as_printed"}})


def longer(at: Path) -> object:
    """A belt that goes steadily to the end of the scene, in a run that goes on."""
    belt = motion(normal={"displacement": RAMP | {"duration": 4.0}})(at)
    assert ts.simulate(belt).ok
    return ts.simulate(belt, 5.0)


def shaken(use: Callable[[Scene, Path], object]) -> tuple[Ask, Said]:
    """A row of what knows no ground that moves."""
    ask = changed("cantilever", ground__motion={"normal": {"displacement": SINE}})
    return lambda at: use(ask(at), at), ("ground.motion: ", " on ground that stays")


def uneven(use: Callable[[Scene, Path], object]) -> tuple[Ask, Said]:
    """A row of what knows no uneven ground."""
    ask = changed(trotter(2, turning=False), ground__profile=STAIRS | {"rise": 1e-7}, initial={"standing": {}})
    return lambda at: use(ask(at), at), ("ground.profile: ", " on level ground alone")


TEETH = {"kind": "sawtooth", "length": 9e-5, "height": 2e-7}
STAIRS = {"kind": "staircase", "tread": 1e-3, "rise": 1e-5}
SINE = {"kind": "sine", "amplitude": 1e-6, "frequency": 100.0}
SQUARE = {"kind": "square", "amplitude": 1e-6, "frequency": 100.0}
RAMP = {"kind": "ramp", "stop": 1e-3, "duration": 1.0}
LINES = {"kind": "sampled", "times": [0.0, 0.1, 0.2], "levels": [0.0, 1e-3, 0.0]}
TIP = {"mass": 1e-7, "stiffness_v": 1.0, "damping_v": 0.0, "stiffness_l": 1.0, "damping_l": 0.0}
BAG = Payload(mass=1e-4, stiffness_v=40.0, damping_v=0.01, stiffness_l=60.0, damping_l=0.01)
SOFT = {"coordinates": ("a", "b"), "mass": [1.0, 2.0], "stiffness": [0.0, 0.0]}


def balls(**soft: Any) -> Ask:
    """Two balls, the second on a ground of its own, called soft."""
    own = {"a": ts.Foot(point="a", gap=1.0), "b": ts.Foot(point="b", gap=1.0, ground="soft")}
    fields: dict[str, Any] = {"ground": {"restitution": {"coefficient": 0.8}}, "grounds": soft}
    return made(Scene, name="balls", robot=ts.Robot(structure=Lumped(**SOFT), feet=own), duration=2.5, **fields)


GROUNDS: Rows = {
    "landing, no speed": (
        changed("cantilever", ground__landing={"kind": "restitute_first"}),
        "ground.landing.speed: missing",
    ),
    "landing, speed": (
        changed("cantilever", ground__landing={"kind": "restitute_first", "speed": -0.1}),
        ("ground.landing.speed: ", "at least 0"),
    ),
    "landing, kind": (
        changed("cantilever", ground__landing={"kind": "restitute"}),
        ("ground.landing.kind: unknown kind 'restitute'", "restitute_first"),
    ),
    "landing, no kind": (
        changed("cantilever", ground__landing={"speed": 0.1}),
        "ground.landing: expected a table with a 'kind'",
    ),
    **{
        f"pull as printed, {name}": (printed(**shapes), ("ground.landing: ", "K_pp", "2 coordinates"))
        for name, shapes in {
            "too few points": {"foot": (1.0, 1.0)},
            "alike": {"foot": (1.0, 1.0), "hip": (2.0, 2.0)},
            "too many": {"foot": (1.0, 1.0), "hip": (2.0, 1.0), "knee": (1.0, 0.0)},
        }.items()
    },
    "film, thickness": (made(Film, coefficient=1e-21, thickness=0.0), "Film.thickness: expected "),
    "film, coefficient": (made(Film, coefficient=-1e-21, thickness=1e-6), "Film.coefficient: expected "),
    "restitution above 1": (made(Restitution, coefficient=1.01), "Restitution.coefficient: expected "),
    "restitution below 0": (made(Restitution, coefficient=-0.39), "Restitution.coefficient: expected "),
    "adhesion": (made(Adhesion, initial=math.nan, rate=0.0), "Adhesion.initial: expected "),
    "electrostatic": (made(Electrostatic, coefficient=1.0, offset=0.0), "Electrostatic.offset: expected "),
    "friction": (made(Friction, coefficient=-0.1), ("Friction.coefficient: ", "got -0.1")),
    "impact, foot": (
        impact({"foot1": {**dict.fromkeys(POINTS, 1.0), "foot9": 1.0}}),
        ("ground.impact.columns.foot1.foot9: ", "no point 'foot9'"),
    ),
    "impact, short": (impact({"foot1": {"foot1": 1.0, "foot2": 0.3}}), "2 of the 6 coordinates"),
    "impact, own": (impact({"foot1": dict.fromkeys(POINTS, 0.5)}), "expected 1 at the foot itself"),
    "impact, mode": (
        lambda at: hexapod(signal=Square(amplitude=10.0, frequency=30.0), impact=DominantMode(mode=9)),
        "has 6 modes, got 9",
    ),
    "impact, none": (made(MeasuredImpactMap, columns={}), "at least one foot"),
    "impact, matrix": (
        lambda at: MeasuredImpactMap.from_matrix(np.full((6, 6), 0.3), list(POINTS), {"foot1": "foot1"}),
        "not the identity's",
    ),
    "profile, one point": (profile("polyline", given=[[0.0, 0.0]]), "two points at least, got 1"),
    "profile, backwards": (profile("polyline", given=[[0.0, 0.0], [-1.0, 0.0]]), "point 1 lies behind point 0"),
    "profile, one point twice": (profile("polyline", given=[[0.0, 0.0], [0.0, 0.0]]), "points 0 and 1 are one"),
    "profile, a side of three": (
        profile("polyline", given=[[0.0, 0.0], [0.0, 1.0], [0.0, 2.0]]),
        "give the side of a step two points",
    ),
    "pits": (profile("pits", spacing=1.0, width=2.0, depth=1.0), "point 4 lies behind point 3"),
    "uneven, packet": uneven(lambda scene, at: packet_of(scene, 1e-3)),
    "uneven, MATLAB": uneven(lambda scene, at: ts.export(scene, to="matlab", output=at)),
    "profile, file": (profile("file", file="nowhere.csv"), "cannot be read"),
    "stairs": (profile("staircase", tread=0.0, rise=1.0), "tread"),
    "stairs, restitution": (profile(**STAIRS, restitution=[1.5]), "restitution"),
    "profile, no walker": (
        changed(scene_of("p1_n2"), ground__profile=STAIRS),
        "ground.profile: is ground under the feet of a walker",
    ),
    "feet, one side": (feet(left=TEETH), "foot 'leg1' has no ground: give that of its name or its side"),
    "feet, no foot": (feet(left=TEETH, right=TEETH, leg9=TEETH), "feet.leg9: the robot has no foot 'leg9'"),
    "feet, too many": (feet(leg0=TEETH, leg1=TEETH, left=TEETH), "feet.left: is the ground of no foot: leave it out"),
    "feet, length": (feet(left=TEETH, right=TEETH | {"length": -1.0}), ("feet.right", "length")),
    "grounds, name": (balls(sof={}), "robot.feet.b.ground: there is no 'soft' in grounds"),
    "grounds, gravity": (balls(soft={"gravity": {"acceleration": 1.0}}), "grounds.soft.gravity: is of all feet"),
    "grounds, film": (
        balls(soft={"film": {"coefficient": 1.0, "thickness": 1.0}}),
        "grounds.soft.film: ground has no film",
    ),
    "motion, none": (motion(), "ground.motion: expected normal, along or both"),
    "motion twice": (motion(normal={"displacement": SINE, "velocity": SINE}), "got displacement and velocity"),
    "motion in volts": (motion(normal={"displacement": SINE | {"amplitude": "1 V"}}), "amplitude: expected a length"),
    "motion, an edge": (motion(normal={"displacement": SQUARE}), "would jump at 0.005 s, an impact"),
    "motion, an edge of the speed": (motion(normal={"velocity": SQUARE}), "would jump at 0.005 s, an impact"),
    "motion, a corner": (motion(normal={"displacement": RAMP}), "would jump at 1 s, an impact"),
    "motion, a corner after the scene": (longer, "would jump at 4 s"),
    "motion, a corner of a batch": (
        lambda at: ts.simulate_batch(
            motion(normal={"displacement": RAMP | {"duration": 4.0}})(at),
            {"ground.motion.normal.displacement.duration": [4.0, 3.0]},
        ),
        "would jump at 3 s",
    ),
    "shaken, export": shaken(lambda scene, at: Subject.of(scene, 1e-3)),
    "shaken, landing": shaken(lambda scene, at: ts.design.landing(scene, foot="tip", levels=(0.0, 8.0))),
    "shaken, campaign": shaken(lambda scene, at: ts.synthesize(scene, output=at)),
    "motion, lines": (motion(normal={"displacement": LINES}), "join samples by a cubic spline"),
    "motion, no way along": (
        motion(along={"displacement": SINE}),
        "robot.structure.forward: the structure needs to know",
    ),
    "motion, base by its speed": (motion(normal={"velocity": SINE}, base="stays"), "give the displacement"),
    "motion, base of a walker": (
        motion("millipede", normal={"displacement": SINE}, base="stays"),
        "a walker has no base that could stay",
    ),
    "start in a laboratory": (
        changed(scene_of("ball"), initial__in_laboratory=True),
        "initial.in_laboratory: the ground does not move",
    ),
    "motion, no upward": (
        changed("hexapod", ground__motion={"normal": {"displacement": SINE}}, ground__gravity=None),
        "robot.structure.upward: the structure needs to know",
    ),
    "start, twice": (changed(trotter(2), initial={"standing": {}, "displacement": [0.0] * 6}), "give one of the two"),
    "start, no walker": (changed("cantilever", initial={"standing": {}}), "only a walker stands on its feet"),
}

TURNING = "turning-hexapod"
TURNED = {"duration": 0.01}
PLANE = "legs that move upward and along the way alone"


def one_drive(at: Path) -> object:
    """A gait that turns, of a drive of both sides."""
    scene = trotter(2)
    both = scene.robot.drives["leg0"].model_copy(update={"load": ts.PointLoad(weights={"leg0": -1.0, "leg1": -1.0})})
    feet = {name: foot.model_copy(update={"electrode": None}) for name, foot in scene.robot.feet.items()}
    gait = {"kind": "free", "frequency": 10.0, "high": 1.0, "phases": {"leg0": 0.0, "leg1": 0.0}, "turn": 0.5}
    return with_values(scene, {"robot.drives": {"all": both}, "robot.feet": feet, "signals": {}, "gait": gait})


WALKERS: Rows = {
    "orbit of one that turns": (lambda at: ts.periodic(changed(TURNING, **TURNED)(at)), PLANE),
    "program of one that turns": (lambda at: ts.export(changed(TURNING, **TURNED)(at), to="c", output=at), PLANE),
    "page of one that turns": (lambda at: ts.explore(changed(TURNING, **TURNED)(at), at / "nowhere.html"), PLANE),
    "drive of both sides": (one_drive, "gait.turn: drive 'all' moves legs of both sides"),
    "one leg across": (
        changed(TURNING, robot__structure__legs__LF__stiffness_t=None),
        "every leg has stiffness_t and damping_t, or none has",
    ),
    "tip of a leg across": (changed(TURNING, robot__structure__legs__LF__tip=TIP), "has no compliant tip"),
    "payload of one that turns": (changed(TURNING, robot__structure__payloads={"bag": BAG}), "has no payloads"),
    "incline of one that turns": (
        changed(TURNING, ground__incline=0.1),
        "ground.incline: goes by the way straight ahead",
    ),
    "profile of one that turns": (changed(TURNING, ground__profile=STAIRS), "ground.profile: goes by the way"),
    "yaw of straight legs": (
        changed("hamr-like", robot__structure__body__yaw_inertia=1e-7),
        "a body turns about z on legs that move across the way",
    ),
}

LAW = "from tarsus.model.laws import SmoothLaw\nfrom tarsus.base.spec import quantity\n"
FORCE = f"{LAW}class A(SmoothLaw):\n    def force(gap, gap_rate, volts, time):\n"


def law(text: str, *said: str) -> tuple[Ask, Said]:
    return written(text, "law.py", ts.load_laws), said


def own(base: str, *lines: str, said: str) -> tuple[Ask, Said]:
    """A row of a law that breaks what its kind promises, where one is made."""
    head = f"from tarsus import quantity\nfrom tarsus.model.laws import {base}\nclass Own({base}):\n"
    body = "".join(f"    {line}\n" for line in lines)
    return written(head + body, "law.py", lambda file: ts.load_laws(file)["own"]()), said


LAWS: Rows = {
    "division": law(LAW + "x = 1 / 0\n", "law.py, line 3: ZeroDivisionError: division by zero"),
    "exit": law(LAW + "import sys\nsys.exit(3)\n", "law.py, line 4: SystemExit: 3"),
    "syntax": law(LAW + "def f(:\n", "law.py, line 3: SyntaxError"),
    "import": law("import no_such_module_at_all\n", "law.py, line 1: ModuleNotFoundError"),
    "no law": law(LAW, "defines no law; a law is a class derived from one of DampingLaw, SmoothLaw"),
    "field": law(LAW + "class A(SmoothLaw):\n    a: float = 3.0\n", "line 3: TypeError: A.a: a law's field"),
    "no function": law(
        LAW + "class A(SmoothLaw):\n    pass\n", "law A defines no function force(gap, gap_rate, volts, time)"
    ),
    "error": law(
        FORCE + "        return 1 / 0\n", "law.py: A.force, line 5: it raises ZeroDivisionError (division by zero)"
    ),
    "nothing": law(
        FORCE + "        return None\n", "law.py: A.force, line 4: it returns nothing on some path, not a number"
    ),
    "infinity": law(FORCE + "        return gap * 1e308 * 1e9", "law A must return a finite number, got inf"),
    "arguments": law(
        LAW + "class A(SmoothLaw):\n    def force(gap):\n        return 0.0\n",
        "line 3: TypeError: A.force: takes (gap), but must take (gap, gap_rate, volts, time)",
    ),
    "loop": law(
        FORCE + "        while gap > 1:\n            gap /= 2\n        return gap\n",
        "law.py: A.force, line 5: more than 256 comparisons in a row",
    ),
    "friction that drives": own(
        "FrictionLaw",
        'share: float = quantity("1", "share", default=0.3)',
        'leading = ("margin", "strength")',
        "def bound(margin, strength, share): return -share * margin",
        said="bound is negative at margin 1e-06",
    ),
    "memory that jumps": own(
        "AdhesionLaw",
        'rate: float = quantity("N/s", "rate", default=1e-3)',
        "def strength(age, rate): return rate * age",
        "def remaining(age, away, rate): return age / (1 + 1e6 * away * away)",
        said="remaining is no flow of time: of an age",
    ),
    "no law file": (lambda at: ts.load_laws(at / "law.py"), "no such law file"),
}


def device(name: str, *said: str, **options: Any) -> tuple[Ask, Said]:
    return (lambda at: load_scene(name, **options)), said


FILES: Rows = {
    "no scene file": (lambda at: read_scene(at / "none.toml"), "no such file"),
    "no TOML": (written("name = \n", "a.toml", read_scene), "not valid TOML: Invalid value"),
    "no text": (written(b"\xff\xfe\x00", "a.toml", read_scene), "no text file"),
    "a folder": (lambda at: read_scene(at), "cannot be read"),
    "device": device("cantilver", "no device is called 'cantilver'; did you mean 'cantilever'?"),
    "device's file": device("none.toml", "none.toml: no such file"),
    "wave": device("cantilever", "signals.pzt.kind: there is no wave 'sqare'; did you mean 'square'?", wave="sqare"),
    "volts of a constant": device(
        "cantilever", "signals.pzt: a constant wave has no amplitude", wave="constant", volts=3
    ),
    "volts in mm": device(
        "cantilever", "signals.pzt.amplitude: expected a voltage (V), got '3 mm', which is a length", volts="3 mm"
    ),
    "hertz": device("cantilever", "signals.pzt.frequency: expected a frequency (Hz) above 0, got -1", hz=-1),
    "all at once": device(
        "cantilever",
        "volt: unknown name; did you mean 'volts'?",
        "signals.pzt.kind: there is no wave 'sinus'",
        "signals.pzt.frequency: expected a frequency (Hz) above 0, got -4",
        wave="sinus",
        hz=-4,
        volt=1,
    ),
    "wave of a gait": device(
        "millipede", "the drives follow a gait", "gait.frequency: expected a frequency (Hz) above 0", wave="sine", hz=-3
    ),
    "path": device("cantilever", "unknown path; did you mean 'ground.film.thickness'?", **{"ground.flm.thickness": 1}),
    "duty": device("cantilever", "signals.pzt.duty: missing; expected a pure number from 0 to 1", wave="ramped_square"),
}


@wrong_inputs.cases(STRUCTURES | ROBOTS | DRIVES | GROUNDS | WALKERS | LAWS | FILES)
def test_wrong_input_is_a_sentence(ask: Ask, said: Said, tmp_path: Path) -> None:
    wrong_inputs.is_refused(ask, said, tmp_path)
