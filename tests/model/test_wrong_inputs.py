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
from tarsus.base.spec import validate, with_values
from tarsus.export.subject import Subject
from tarsus.files.library import load_scene
from tarsus.files.toml import read_scene
from tarsus.model.drive.laws import Creeping, LinearForce
from tarsus.model.drive.laws.prandtl_ishlinskii import PrandtlIshlinskii, fit_branches
from tarsus.model.drive.lower import evaluate, lower
from tarsus.model.drive.waveforms import OnOff, Sampled, Sine, Square, SweptSine
from tarsus.model.laws.impact_map import DominantMode, MeasuredImpactMap
from tarsus.model.scene import Ground, Scene
from tarsus.model.structure import Beam, Lumped, Modal, Payload, Walker
from tarsus.model.structure.leg_motion import step_response
from tarsus_reproduce.legs import millipede_leg
from walking_scenes import trotter
from wrong_inputs import Ask, Said, written

Rows = dict[str, tuple[Ask, Said]]


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


def walker(**legs: dict[str, Any]) -> Ask:
    leg = {"mass": "1 ug", "stiffness_v": 1.2, "damping_v": 1e-3, "stiffness_l": 0.7, "damping_l": 2e-4}
    return made(Walker, body={"mass": 1.0}, legs={name: leg | own for name, own in legs.items()})


MODAL = {"damping_ratios": 1, "modal_masses": 3, "shapes.a": 1}
NO_INERTIA = "mass: the mass matrix is singular: some motion has no inertia"
BETWEEN = "frequencies: with this tip the second frequency is at "
STRUCTURES: Rows = {
    "negative mass": (lumped(mass=["-1 mg", "2 mg"]), "mass.0.0: expected a mass (kg) above 0, got -1e-06: a mass is"),
    "singular mass": (lumped(mass=[[1.0, 1.0], [1.0, 1.0]]), NO_INERTIA),
    "indefinite mass": (lumped(mass=[[1.0, 2.0], [2.0, 1.0]]), "mass: the mass matrix is not positive definite"),
    "asymmetric mass": (lumped(mass=[[1.0, 0.1], [0.2, 1.0]]), "mass: the mass matrix must be symmetric"),
    "one row": (lumped(stiffness=[[1.0, 2.0]]), "stiffness: expected a 2 x 2 matrix, one row a coordinate, got 1 x 2"),
    "damping twice": (lumped(damping=[0.0] * 2, damping_ratios=[0.1] * 2), "give either a damping matrix or damping_r"),
    "one ratio": (lumped(damping_ratios=[0.1]), "damping_ratios: expected 2 values, one a coordinate, got 1"),
    "point of a coordinate's name": (lumped(weights={"tip": [1.0, 0.0]}), "weights.tip: this name is already that of"),
    "one coordinate twice": (lumped(coordinates=["tip", "tip"]), "coordinates: expected different names"),
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
    "no leg": (walker(), ["Walker.legs: ", "at least one leg"]),
    "leg of another's point": (walker(a={}, a_x={}), ["Walker.legs.a: its point 'a_x' ", "Walker.legs.a_x: "]),
    "leg of the body's name": (walker(body={}), "Walker.legs.body: its point 'body' would bear the name"),
    "beam, too stiff": (beam(frequencies=[623.0, 30000.0]), BETWEEN + "most 26.6"),
    "beam, too soft": (beam(frequencies=[623.0, 1500.0]), BETWEEN + "least "),
    "beam, backwards": (beam(frequencies=[623.0, 600.0]), "frequencies: the second frequency must be above the first"),
    "beam, no ratio": (beam(damping_ratios=[]), "damping_ratios: expected at least one"),
    "leg that leans back": (lambda at: with_values(millipede_leg().leg, {"shin.angle": -1.0}), "must be above it"),
    "leg that is straight": (
        lambda at: with_values(millipede_leg().leg, {"thigh.angle": np.pi / 2}).linearised(),
        "do not determine the joints",
    ),
    "leg from late on": (lambda at: step_response(millipede_leg().leg, [0.01, 0.02]), "increases from 0"),
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
    "way of its own": (on_foot(along="tip"), "'tip' is the foot's own point"),
    "normal": (made(ts.Foot, point="tip", gap=0.0, normal=2), "Foot.normal: "),
    "start of another size": (placed(initial={"velocity": [0.0]}), "Scene.initial.velocity: "),
    "gravity of no way": (
        placed(robot={"structure": {"kind": "modal", **FREE}, "feet": {"toe": TOE}}, ground={"gravity": {}}),
        "Scene.robot.structure.upward: ",
    ),
}


def amplifier(**fields: Any) -> Ask:
    return changed("cantilever", robot__drives__pzt__amplifier=fields)


def recorded(content: str, said: str, name: str = "a.csv") -> tuple[Ask, Said]:
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
LINE = LinearForce(gain=1.0)
FAST = SweptSine(amplitude=1.0, start_frequency=1e6, stop_frequency=1e9, duration=10.0)
TENT = Sampled(times=(0.0, 0.1, 0.2), levels=(0.0, 8.0, 0.0))
CROSSED = {"signals.pull.times.1": [0.1, 0.19], "signals.pull.times.2": [0.3, 0.15]}
DRIVES: Rows = {
    "bandwidth twice": (amplifier(bandwidth="1 kHz", rise_time="1 ms"), (PIEZO, "give one of the two")),
    "rails upside down": (amplifier(clip=["3 V", "-3 V"]), (PIEZO, "before the highest, got 3 V and -3 V")),
    "one rail of nothing": (amplifier(clip="0 V"), (PIEZO, "expected a voltage (V) above 0 for both signs")),
    "sweep of too many cycles": (lambda at: lower(FAST, LINE), "rises and falls about 1e+10 times"),
    "time before the start": (lambda at: evaluate(lower(TENT, LINE)[1], -1.0), "not negative"),
    "pulses, lengths": (made(OnOff, levels=[1, 2], durations=[1]), "durations: expected 2 durations"),
    "pulses, none": (made(OnOff, levels=[], durations=[]), "levels: expected at least one"),
    "samples, none": (made(Sampled), "expected either times and levels, or a file"),
    "samples and a file": (made(Sampled, times=[0, 1], levels=[0, 1], file="x.csv"), "file: give either"),
    "samples at one time": (made(Sampled, times=[0, 1, 1], levels=[0, 1, 2]), "times: sample times must increase"),
    "samples, one voltage": (made(Sampled, times=[0, 1], levels=[0]), "times: expected as many times as voltages"),
    "one sample": (made(Sampled, times=[0], levels=[0]), "times: expected at least two samples"),
    "start of samples": (made(Sampled, times=(0.0, 1.0), levels=(0.0, 1.0), start=1.0), "start: is of a file"),
    "samples that cross in a batch": (
        lambda at: ts.simulate_batch(scene_of("p1_n2", {"signals": {"pull": TENT}}), CROSSED),
        "sample times must increase",
    ),
    "no file": (lambda at: Sampled(file=str(at / "none.csv")), "there is no file"),
    "a word": recorded("0,1\n1,2\n2,fish\n", "a.csv, line 3: column 'column 2' has 'fish' where a number is expected"),
    "no volts": recorded("a,b,c\n0,1,2\n1,1,2\n", "a.csv has no column 'volts'; valid names are 'a', 'b', 'c'; name"),
    "times that go back": recorded("0,1\n2,1\n1,1\n", "2.0 s is followed by 1.0 s"),
    "no rows": recorded("\n", "a.csv holds no rows of numbers"),
    "no number": recorded("0,1\n1,nan\n2,1\n", "expected finite samples, got a NaN"),
    "column in mm/s": recorded("time (s),v (mm/s)\n0,1\n1,2\n", "'v' is in 'mm/s', which is no unit of voltage"),
    "column in furlongs": recorded("time (s),v (furlong)\n0,1\n1,2\n", "'furlong' is no unit of voltage; name"),
    "MATLAB's in name": recorded("not a mat file at all", "a.mat is no MATLAB file", name="a.mat"),
    "cut": recorded("Samples,4\ntime (s),v (V)\n0,1\n1,2\n", "a.csv is truncated: channel 'v' has 2 values"),
    "plays, one weight": (
        made(PrandtlIshlinskii, linear=1.0, thresholds=(1.0, 2.0), weights=(1.0,)),
        "weights: expected 2 weights",
    ),
    "force out of reach": (lambda at: PLAYS.inverse([1.0, 100.0]), "force 2, 100.0 N, is out of reach"),
    "force out of limits": (lambda at: PLAYS.inverse([5.0], limits=(-1.0, 1.0)), "out of reach between -1 V and 1 V"),
    "plays against the rest": (
        lambda at: PrandtlIshlinskii(linear=1.0, thresholds=(1.0, 2.0), weights=(-1.5, 1.0)).inverse([0.1]),
        "has no inverse",
    ),
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
}


def feet(**grounds: Any) -> Ask:
    return lambda at: with_values(trotter(2), {"ground.profile": {"kind": "feet", "feet": grounds}})


def profile(kind: str, **fields: Any) -> Ask:
    return lambda at: validate(Ground, {"profile": {"kind": kind, **fields}})


def motion(device: str = "ball", **fields: Any) -> Ask:
    made_of = load_scene(device) if device in ("millipede", "hexapod") else scene_of(device)
    return changed(made_of, ground__motion=fields)


def impact(columns: dict[str, Any]) -> Ask:
    base = hexapod(signal=BEAT, impact=printed_map())
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


BEAT = Square(amplitude=10.0, frequency=30.0)
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
    **{
        f"pull as printed, {name}": (printed(**shapes), ("ground.landing: ", "K_pp", "2 coordinates"))
        for name, shapes in {
            "too few points": {"foot": (1.0, 1.0)},
            "alike": {"foot": (1.0, 1.0), "hip": (2.0, 2.0)},
            "too many": {"foot": (1.0, 1.0), "hip": (2.0, 1.0), "knee": (1.0, 0.0)},
        }.items()
    },
    "impact, foot": (impact({"foot1": {**dict.fromkeys(POINTS, 1.0), "foot9": 1.0}}), "columns.foot1.foot9: "),
    "impact, short": (impact({"foot1": {"foot1": 1.0, "foot2": 0.3}}), "2 of the 6 coordinates"),
    "impact, own": (impact({"foot1": dict.fromkeys(POINTS, 0.5)}), "expected 1 at the foot itself"),
    "impact, mode": (lambda at: hexapod(signal=BEAT, impact=DominantMode(mode=9)), "has 6 modes, got 9"),
    "impact, none": (made(MeasuredImpactMap, columns={}), "at least one foot"),
    "impact, matrix": (
        lambda at: MeasuredImpactMap.from_matrix(np.full((6, 6), 0.3), list(POINTS), {"foot1": "foot1"}),
        "not the identity's",
    ),
    "profile, one point": (profile("polyline", given=[[0.0, 0.0]]), "two points at least, got 1"),
    "profile, backwards": (profile("polyline", given=[[0.0, 0.0], [-1.0, 0.0]]), "point 1 lies behind point 0"),
    "profile, one point twice": (profile("polyline", given=[[0.0, 0.0], [0.0, 0.0]]), "points 0 and 1 are one"),
    "profile, a side of three": (profile("polyline", given=[[0, 0], [0, 1], [0, 2]]), "the side of a step two points"),
    "pits": (profile("pits", spacing=1.0, width=2.0, depth=1.0), "point 4 lies behind point 3"),
    "profile, file": (profile("file", file="nowhere.csv"), "cannot be read"),
    "profile, no walker": (changed(scene_of("p1_n2"), ground__profile=STAIRS), "ground.profile: is ground under the"),
    "feet, one side": (feet(left=TEETH), "foot 'leg1' has no ground: give that of its name or its side"),
    "feet, no foot": (feet(left=TEETH, right=TEETH, leg9=TEETH), "feet.leg9: the robot has no foot 'leg9'"),
    "feet, too many": (feet(leg0=TEETH, leg1=TEETH, left=TEETH), "feet.left: is the ground of no foot: leave it out"),
    "grounds, name": (balls(sof={}), "robot.feet.b.ground: there is no 'soft' in grounds"),
    "grounds, gravity": (balls(soft={"gravity": {"acceleration": 1.0}}), "grounds.soft.gravity: is of all feet"),
    "grounds, film": (balls(soft={"film": {"coefficient": 1.0, "thickness": 1.0}}), "grounds.soft.film: ground has no"),
    "motion, none": (motion(), "ground.motion: expected normal, along or both"),
    "motion twice": (motion(normal={"displacement": SINE, "velocity": SINE}), "got displacement and velocity"),
    "motion, an edge": (motion(normal={"displacement": SQUARE}), "would jump at 0.005 s, an impact"),
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
    "motion, no way along": (motion(along={"displacement": SINE}), "robot.structure.forward: the structure needs to"),
    "motion, base by its speed": (motion(normal={"velocity": SINE}, base="stays"), "give the displacement"),
    "motion, base of a walker": (
        motion("millipede", normal={"displacement": SINE}, base="stays"),
        "a walker has no base",
    ),
    "start in a laboratory": (changed(scene_of("ball"), initial__in_laboratory=True), "the ground does not move"),
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
    "one leg across": (changed(TURNING, robot__structure__legs__LF__stiffness_t=None), "every leg has stiffness_t and"),
    "tip of a leg across": (changed(TURNING, robot__structure__legs__LF__tip=TIP), "has no compliant tip"),
    "payload of one that turns": (changed(TURNING, robot__structure__payloads={"bag": BAG}), "has no payloads"),
    "incline of one that turns": (changed(TURNING, ground__incline=0.1), "ground.incline: goes by the way straight"),
    "profile of one that turns": (changed(TURNING, ground__profile=STAIRS), "ground.profile: goes by the way"),
    "yaw of straight legs": (changed("hamr-like", robot__structure__body__yaw_inertia=1e-7), "a body turns about z on"),
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
    "no law": law(LAW, "defines no law; a law is a class derived from one of DampingLaw, SmoothLaw"),
    "field": law(LAW + "class A(SmoothLaw):\n    a: float = 3.0\n", "line 3: TypeError: A.a: a law's field"),
    "no function": law(LAW + "class A(SmoothLaw):\n    pass\n", "law A defines no function force(gap, gap_rate, "),
    "error": law(FORCE + "        return 1 / 0\n", "law.py: A.force, line 5: it raises ZeroDivisionError"),
    "infinity": law(FORCE + "        return gap * 1e308 * 1e9", "law A must return a finite number, got inf"),
    "arguments": law(
        LAW + "class A(SmoothLaw):\n    def force(gap):\n        return 0.0\n",
        "line 3: TypeError: A.force: takes (gap), but must take (gap, gap_rate, volts, time)",
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
    "volts of a constant": device("cantilever", "a constant wave has no amplitude", wave="constant", volts=3),
    "all at once": device(
        "cantilever",
        "volt: unknown name; did you mean 'volts'?",
        "signals.pzt.kind: there is no wave 'sinus'; did you mean 'sine'?",
        "signals.pzt.frequency: expected a frequency (Hz) above 0, got -4",
        wave="sinus",
        hz=-4,
        volt=1,
    ),
    "wave of a gait": device("millipede", "the drives follow a gait", "gait.frequency: ", wave="sine", hz=-3),
    "path": device("cantilever", "unknown path; did you mean 'ground.film.thickness'?", **{"ground.flm.thickness": 1}),
}


@wrong_inputs.cases(STRUCTURES | ROBOTS | DRIVES | GROUNDS | WALKERS | LAWS | FILES)
def test_wrong_input_is_a_sentence(ask: Ask, said: Said, tmp_path: Path) -> None:
    wrong_inputs.is_refused(ask, said, tmp_path)
