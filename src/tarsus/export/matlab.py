"""What is written for MATLAB: matrices, the state space of every set of held feet, events, series, laws as functions,
and a script that makes the run again."""

from __future__ import annotations

import io
from collections.abc import Mapping
from importlib.resources import files
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
from scipy.io import savemat

from tarsus.base.errors import InputError, InputProblem
from tarsus.base.events import FootState
from tarsus.export.subject import Floats, Subject, expanded, knots
from tarsus.export.verb import Exported
from tarsus.files.store import events_csv, write_matlab
from tarsus.model.laws import MassWeighted, PullAsPrinted, RestituteFirst
from tarsus.model.laws.base import Law
from tarsus.model.laws.program import Op, Program
from tarsus.plan.lowering import program_of

ARGUMENTS = {"momentum": "gap", "force": "gap, rate, volts, time", "rebound": "speed", "strength": "age, volts"}
"""Functions of laws.m, by hook: what they take."""


def exported(described: Subject, step: float | None) -> Exported:
    """The files of a scene. Raises InputError for a step: the script finds its own."""
    if step is not None:
        raise InputError(InputProblem.at("step", "a model for MATLAB has none: its script finds its own"))
    model, reason = io.BytesIO(), _reason(described)
    savemat(model, _content(described, reason), format="5", long_field_names=True, oned_as="column")
    with TemporaryDirectory() as folder:
        write_matlab(described.run.events, described.run.variables(), series := Path(folder) / "series.mat")
        whole = series.read_bytes()
    lost = [f"run_model.m does not run this robot: {reason}"] if reason else []
    ageing = [name for name, law in described.scene.ground.acting_laws.items() if "remaining" in type(law).functions()]
    lost += [f"{name}: what a contact remembers of those before it" for name in ageing]
    out: dict[str, str | bytes] = {
        "model.mat": model.getvalue(),
        "series.mat": whole,
        "laws.m": laws_text(described.scene.ground.acting_laws),
        "events.csv": events_csv(described.run.events, described.feet),
        "run_model.m": (files("tarsus.export") / "run_model.m").read_text(encoding="utf-8"),
    }
    return Exported.listed(out, lost)


def _reason(described: Subject) -> str:
    """Why the script cannot make the run, "" where it can."""
    ground = described.scene.ground
    if described.scene.slides:
        return "its feet rub on the ground, and the script knows no friction"
    if ground.impact is not None and not isinstance(ground.impact, MassWeighted):
        return f"its impacts follow the map '{ground.impact.kind}', and the script's are mass-weighted"
    if isinstance(ground.landing_rule, PullAsPrinted):
        return "its feet land by the pull as printed, which the script does not know"
    if any("remaining" in type(law).functions() for law in ground.acting_laws.values()):
        return "its contacts remember those before them"
    if any(law.by_volts() for law in ground.acting_on("strength").values()):
        return "what holds its feet goes by their volts, which the script does not know"
    if not described.feet:
        return "it has no feet"
    return ""


def _content(described: Subject, reason: str) -> dict[str, Any]:
    """Variables of model.mat; SI units."""
    plan, run, scene = described.plan, described.run, described.scene
    system = plan.system
    n = len(system.mass)
    rule = scene.ground.landing_rule
    whole = [expanded(one, run.duration) for one in plan.channels]
    events = run.events
    cells = np.empty(len(whole), dtype=object), np.empty(len(whole), dtype=object)
    for k, one in enumerate(whole):
        cells[0][k], cells[1][k] = one.start, one.coef
    floor = np.abs(run.states(np.linspace(0.0, run.end_time, 200)).x).max(axis=1)
    return {
        "name": scene.name,
        "runs": not reason,
        "reason": reason,
        "mass": system.mass,
        "damping": system.damping,
        "stiffness": system.stiffness,
        "normals": system.normals,
        "gap": system.rest_gap,
        "loads": system.loads,
        "weight": system.constant,
        "x0": plan.initial[:n],
        "v0": plan.initial[n:],
        "feet": float(len(described.feet)),
        "drives": float(len(described.drives)),
        "foot_names": np.array(described.feet, dtype=object),
        "drive_names": np.array(described.drives, dtype=object),
        "duration": run.duration,
        "length": plan.length,
        "rate": plan.rate,
        "tiny": 1e-14 * plan.length,
        "scale": np.maximum(floor, 1e-6 * floor.max(initial=1e-30)),
        "knots": knots(plan.channels, run.duration),
        "starts": cells[0],
        "coefs": cells[1],
        "now": np.ones(max(len(whole), 1)),
        "wired": plan.laws.volts + 1.0,
        "restitutes_first": isinstance(rule, RestituteFirst),
        "landing_speed": getattr(rule, "speed", 0.0),
        "adheres": scene.ground.holds,
        "sets": state_spaces(described),
        "events": np.column_stack([events["time"], events["foot"] + 1.0, events["kind"]]),
    }


def state_spaces(described: Subject) -> dict[str, Any]:
    """A, B, C and D of every set of held feet that the run has met, in its order: the state is [x; v], the inputs are
    the forces on the feet along their normals (m), of the drives (nd), and 1; the outputs gaps, gap rates, and the
    structure's pull on held feet (0 for others), m each. ``along``: feet that are held along the ground as well."""
    plan, run = described.plan, described.run
    system, m = plan.system, len(described.feet)
    n, tangents = len(system.mass), _ways(described)
    times = np.unique(np.concatenate([[0.0, run.end_time], run.events["time"]]))
    times = times[times <= run.end_time]
    seen = run.states(0.5 * (times[1:] + times[:-1])) if m else None
    held = np.zeros((0, 1), dtype=bool) if seen is None else seen.held
    stuck = (
        held & (seen.contact == FootState.STUCK)
        if seen is not None and seen.contact is not None
        else np.zeros_like(held)
    )
    met = list(dict.fromkeys(zip(map(tuple, held.T.tolist()), map(tuple, stuck.T.tolist()), strict=True)))
    names = ("held", "along", "A", "B", "C", "D")
    out: dict[str, Any] = {name: np.empty(len(met), dtype=object) for name in names}
    zero, eye = np.zeros((n, n)), np.eye(n)
    for k, (feet, still) in enumerate(met):
        down = np.array(feet, dtype=bool)
        rows = np.hstack([system.normals[:, down], tangents[:, np.array(still, dtype=bool)]])
        minv = np.linalg.inv(system.mass)
        lever = np.linalg.pinv(rows.T @ minv @ rows) @ rows.T @ minv
        free = minv @ (eye - rows @ lever)
        into = np.hstack([system.normals, system.loads, system.constant[:, None]])
        a = np.block([[zero, eye], [-free @ system.stiffness, -free @ system.damping]])
        pull, feed = np.zeros((m, 2 * n)), np.zeros((m, into.shape[1]))
        first = lever[: int(down.sum())]
        pull[down], feed[down] = -first @ np.hstack([system.stiffness, system.damping]), first @ into
        gap = np.zeros((m, into.shape[1]))
        gap[:, -1] = system.rest_gap
        out["held"][k], out["along"][k], out["A"][k] = down.astype(float), np.array(still, dtype=float), a
        out["B"][k] = np.vstack([np.zeros((n, into.shape[1])), free @ into])
        normals, none = system.normals.T, np.zeros((m, n))
        out["C"][k] = np.vstack([np.hstack([normals, none]), np.hstack([none, normals]), pull])
        out["D"][k] = np.vstack([gap, np.zeros_like(gap), feed])
    return out


def _ways(described: Subject) -> Floats:
    """Rows (n, m) of places along the ground, zeros for feet that know none."""
    system, structure = described.plan.system, described.scene.robot.structure
    if system.tangents is not None:
        return system.tangents
    if not described.scene.slides:
        return np.zeros_like(system.normals)
    return np.stack([structure.row(f"{foot.point}_x") for foot in described.scene.robot.feet.values()], axis=1)


def laws_text(acting: Mapping[str, Law]) -> str:
    """``laws.m``: the laws of the ground as functions of numbers, their parameters written in."""
    bodies, lines = [], ["function law = laws()", "% Laws between a foot and the ground, SI units."]
    for hook, arguments in ARGUMENTS.items():
        own = [law for law in acting.values() if law.hook == hook]
        lines.append(f"  law.{hook} = @{hook};")
        bodies += ["", f"function out = {hook}({arguments})", "  out = 0;"]
        for law in own:
            bodies += [
                f"  % {type(law).name()}",
                *_statements(program_of(type(law), hook), arguments, law.parameters()),
            ]
        bodies.append("end")
    return "\n".join([*lines, "end", *bodies, "", *_IFELSE, ""])


def _statements(program: Program, arguments: str, parameters: tuple[float, ...]) -> list[str]:
    names = arguments.split(", ")[: program.arguments]
    names += [f"({value:.17g})" for value in (*parameters, *program.constants.tolist())]
    lines = []
    for k, (number, *operands) in enumerate(program.code.tolist()):
        op = Op(number)
        given = [names[place] for place in operands[: op.operands]]
        lines.append(f"  r{k} = {_OPERATIONS[op].format(*given)};")
        names.append(f"r{k}")
    return [*lines, f"  out = out + {names[-1]};"]


_IFELSE = ("function out = ifelse(test, then, other)", "  out = other;", "  if test, out = then; end", "end")
"""The second where the first is not zero, else the third."""

_INFIX = {
    Op.ADD: "+",
    Op.SUBTRACT: "-",
    Op.MULTIPLY: "*",
    Op.DIVIDE: "/",
    Op.LESS: "<",
    Op.LESS_EQUAL: "<=",
    Op.EQUAL: "==",
    Op.NOT_EQUAL: "~=",
    Op.POWER: "^",
}
_SAME = (
    "SQRT",
    "FLOOR",
    "CEIL",
    "HYPOT",
    "ATAN2",
    "EXP",
    "EXPM1",
    "LOG",
    "LOG1P",
    "LOG2",
    "LOG10",
    "SIN",
    "COS",
    "TAN",
    "ASIN",
    "ACOS",
    "ATAN",
    "SINH",
    "COSH",
    "TANH",
    "ASINH",
    "ACOSH",
    "ATANH",
    "ERF",
    "ERFC",
    "ISFINITE",
    "ISNAN",
    "ISINF",
)
_OPERATIONS: Mapping[Op, str] = {
    **{op: f"{'double' * (sign[0] in '<=~')}({{0}} {sign} {{1}})" for op, sign in _INFIX.items()},
    **{Op[name]: f"double({name.lower()}({'{0}, {1}' if Op[name].operands == 2 else '{0}'}))" for name in _SAME},
    Op.COPY: "{0}",
    Op.NEGATE: "-{0}",
    Op.ABSOLUTE: "abs({0})",
    Op.MINIMUM: "min({0}, {1})",
    Op.MAXIMUM: "max({0}, {1})",
    Op.TRUNC: "fix({0})",
    Op.ROUND: "ifelse(abs(rem({0}, 1)) == 0.5, 2 * round({0} / 2), round({0}))",
    Op.FLOOR_DIVIDE: "floor({0} / {1})",
    Op.MODULO: "mod({0}, {1})",
    Op.FMOD: "rem({0}, {1})",
    Op.COPYSIGN: "abs({0}) * (1 - 2 * (1 / {1} < 0 || {1} < 0))",
    Op.SELECT: "ifelse({0}, {1}, {2})",
}
