"""Where ground laws enter the kernels: four functions of plain floats, bound once, and pointers for users' laws.

``momentum``, ``force``, ``rebound`` and ``strength`` are called by the kernels with the parameter row of a foot.
``bind`` gives them the built-in laws (compiled into the kernel, so that they inline); a user's law comes as the
address of its own compiled function, so that adding or editing one never recompiles the kernel.
"""

from __future__ import annotations

import inspect
import math
from collections.abc import Callable
from dataclasses import dataclass

import numba
from llvmlite import ir
from numba import types
from numba.extending import intrinsic, overload

from tarsus.core.jit import PART, inner
from tarsus.core.nodes import N
from tarsus.core.row import load, store

# Pointer columns of a foot: addresses of a user's functions, 0 where there is none.
MOMENTUM, FORCE, REBOUND, STRENGTH = 0, 1, 2, 3
# Flags of a foot: which laws act on it.
HAS_MOMENTUM, HAS_FORCE, USES_RATE, HAS_LATCH = 1, 2, 4, 8
# An impact map that acts as it is, not through its passive projection.
MAP_AS_IS = 16
# The rule by which a foot lands, see core.landing; without one of these it is captured unless pulled.
RESTITUTES_FIRST, PULL_AS_PRINTED = 32, 64


@dataclass(frozen=True)
class BoundLaw:
    """A built-in law's plain function and the columns of the parameter row that hold its parameters."""

    function: Callable[..., float]
    first: int
    count: int


_bound: dict[str, list[BoundLaw]] = {}
_plain: dict[str, Callable[..., float]] = {}
_python_laws: dict[int, Callable[..., float]] = {}
_alive: list[object] = []

_ARGUMENTS = {
    "momentum": ("gap",),
    "force": ("gap", "rate", "volts", "time"),
    "rebound": ("speed",),
    "strength": ("age",),
    "friction": ("margin", "strength"),
    "excess": ("departing",),
}
_COLUMN = {"momentum": MOMENTUM, "force": FORCE, "rebound": REBOUND, "strength": STRENGTH}


def bind(laws: dict[str, list[BoundLaw]]) -> None:
    """Give the kernels their built-in laws: per hook name the functions whose values add up."""
    _bound.clear()
    _bound.update(laws)
    for name in _ARGUMENTS:
        _plain[name] = _assemble(name, compiled=False)
    _plain["momenta"] = _assemble_row(compiled=False)


def bind_angle(function: Callable[..., float]) -> None:
    """Give the kernels the angle of the passive projection of an impact map: function(restitution, skew)."""
    _plain["passive_angle"] = function


def _assemble(name: str, compiled: bool) -> Callable[..., float]:
    """One function of (par, pointer, foot, *arguments): the sum of the bound laws and of the user's, if any can be.

    For ``rebound`` a user's law replaces the built-in one instead of adding to it, and so for ``strength``. A law of the
    gap is promised to be finite on the ground and above; below, where a step's trial may reach beyond a touchdown, its
    value at the ground stands for one that is not.
    """
    arguments = _ARGUMENTS[name]
    terms = []
    scope: dict[str, object] = {"call_pointer": call_pointer}
    for n, law in enumerate(_bound[name]):
        scope[f"law{n}"] = inner(law.function) if compiled else law.function
        columns = ", ".join(f"par[foot, {law.first + c}]" for c in range(law.count))
        terms.append(f"law{n}({', '.join(arguments)}, {columns})")
    built_in = " + ".join(terms) or "0.0"
    body = f"def {name}(par, pointer, foot, {', '.join(arguments)}):\n"
    if name in _COLUMN:
        padded = ", ".join((*arguments, "0.0", "0.0", "0.0")[:4])
        column = _COLUMN[name]
        user = f"call_pointer(pointer[foot, {column}], {padded}, pointer[foot, {column + 4}])"
        replace = name in ("rebound", "strength")
        body += (
            f"    if pointer[foot, {column}] != 0:\n"
            f"        return {user if replace else f'{built_in} + {user}'}\n"
        )
    body += f"    return {built_in}\n"
    exec(body, scope)
    if arguments[0] != "gap":
        return scope[name]  # type: ignore[return-value]
    whole = {"law": inner(scope[name]) if compiled else scope[name], "isfinite": math.isfinite}
    rest = "".join(f", {argument}" for argument in arguments[1:])
    exec(
        f"def {name}(par, pointer, foot, gap{rest}):\n"
        f"    value = law(par, pointer, foot, gap{rest})\n"
        f"    if gap < 0.0 and not isfinite(value):\n"
        f"        return law(par, pointer, foot, 0.0{rest})\n"
        f"    return value\n",
        whole,
    )
    return whole[name]  # type: ignore[return-value]


def _assemble_row(compiled: bool) -> Callable[..., None]:
    """``momenta``: all nodes at once. A built-in resistive law is plain arithmetic of its gap."""
    scope: dict[str, object] = {"momentum": momentum, "load": load, "store": store}
    terms, lines = [], []
    for n, law in enumerate(_bound["momentum"]):
        scope[f"law{n}"] = inner(law.function) if compiled else law.function
        lines += [f"    p{n}_{c} = par[foot, {law.first + c}]\n" for c in range(law.count)]
        terms.append(f"law{n}({', '.join(['row', *(f'p{n}_{c}' for c in range(law.count))])})")
    body = (
        "def momenta(par, pointer, foot, gaps, values):\n"
        f"    if pointer[foot, {MOMENTUM}] != 0:\n"
        f"        for j in range({N}):\n"
        "            values[foot, j] = momentum(par, pointer, foot, gaps[foot, j])\n"
        f"        return\n{''.join(lines)}"
        "    row = load(gaps, (foot,))\n"
        f"    store(values, (foot,), {' + '.join(terms) or 'row * 0.0'})\n"
    )
    exec(body, scope)
    return scope["momenta"]  # type: ignore[return-value]


def momentum(par, pointer, foot, gap):
    """Momentum potential P [N s] of the resistive laws at ``gap`` [m]; the force is dP/dt."""
    return _plain["momentum"](par, pointer, foot, gap)


def force(par, pointer, foot, gap, rate, volts, time):
    """Smooth force [N] on the foot along its normal."""
    return _plain["force"](par, pointer, foot, gap, rate, volts, time)


def momenta(par, pointer, foot, gaps, values):
    """values[foot, :] = momentum potential at the nodal gaps[foot, :]."""
    _plain["momenta"](par, pointer, foot, gaps, values)


def rebound(par, pointer, foot, speed):
    """Departing speed [m/s] after an impact with approach speed ``speed`` [m/s]."""
    return _plain["rebound"](par, pointer, foot, speed)


def strength(par, pointer, foot, age):
    """Largest pull [N] that a contact of that age [s] holds."""
    return _plain["strength"](par, pointer, foot, age)


def friction(par, pointer, foot, margin, strength):
    """Largest friction force [N] of a held foot whose contact of ``strength`` f_a [N] holds ``margin`` = N + f_a [N] more
    than is asked of it."""
    return _plain["friction"](par, pointer, foot, margin, strength)


def excess(par, pointer, foot, departing):
    """How much faster [m/s] a foot departs than one that may be held."""
    return _plain["excess"](par, pointer, foot, departing)


def passive_angle(restitution, skew):
    """Angle [rad] of the passive projection of an impact map, see laws.impact_map."""
    return _plain["passive_angle"](restitution, skew)


@overload(passive_angle, jit_options=PART)
def _passive_angle(restitution, skew):
    compiled = inner(_plain["passive_angle"])
    return lambda restitution, skew: compiled(restitution, skew)


def call_pointer(address, a, b, c, d, parameters):
    """Call a user's compiled function by address (or, without the compiler, by its registered number)."""
    import ctypes

    function, count = _python_laws[address]  # type: ignore[misc]
    row = (ctypes.c_double * count).from_address(int(parameters))
    return function(a, b, c, d, row)


for _name, _stub in (
    ("momentum", momentum), ("force", force), ("rebound", rebound), ("strength", strength), ("friction", friction),
    ("excess", excess),
):  # fmt: skip

    def _implementation(name: str, stub: Callable[..., float]) -> None:
        parameters = ", ".join(inspect.signature(stub).parameters)
        scope: dict[str, object] = {"_assemble": _assemble}
        exec(f"def implementation({parameters}):\n    return _assemble({name!r}, True)\n", scope)
        overload(stub, jit_options=PART)(scope["implementation"])  # type: ignore[arg-type]

    _implementation(_name, _stub)


@overload(momenta, jit_options={**PART, "forceinline": True})
def _momenta(par, pointer, foot, gaps, values):
    return _assemble_row(compiled=True)


@intrinsic
def _indirect(typingctx, address, a, b, c, d, parameters):
    signature = types.float64(types.int64, *([types.float64] * 4), types.int64)

    def generate(context, builder, _signature, arguments):
        double = ir.DoubleType()
        kind = ir.FunctionType(double, [double] * 4 + [double.as_pointer()])
        function = builder.inttoptr(arguments[0], kind.as_pointer())
        row = builder.inttoptr(arguments[5], double.as_pointer())
        return builder.call(function, [*arguments[1:5], row])

    return signature, generate


@overload(call_pointer, jit_options=PART)
def _call_pointer(address, a, b, c, d, parameters):
    def implementation(address, a, b, c, d, parameters):
        return _indirect(address, a, b, c, d, parameters)

    return implementation


def compile_laws(laws: tuple[tuple[Callable[..., float], int], ...], arguments: int) -> int:
    """Compile users' plain functions of floats into one that adds them up; its address for the pointer columns.

    laws: (function, number of parameters), each ``function(*arguments, *parameters) -> float``; their parameters
    stand one after the other. ``arguments`` is the number of leading floats.
    Raises numba.core.errors.NumbaError where a function uses what cannot be compiled.
    """
    scope: dict[str, object] = {}
    terms = []
    first = 0
    for n, (function, count) in enumerate(laws):
        scope[f"law{n}"] = numba.njit(function)
        row = ", ".join(f"row[{first + c}]" for c in range(count))
        terms.append(f"law{n}({', '.join(part for part in (', '.join('abcd'[:arguments]), row) if part)})")
        first += count
    exec(f"def adapter(a, b, c, d, row):\n    return {' + '.join(terms)}\n", scope)
    if numba.config.DISABLE_JIT:  # type: ignore[attr-defined]
        number = len(_python_laws) + 1
        _python_laws[number] = (scope["adapter"], first)  # type: ignore[assignment]
        return number
    signature = types.float64(*([types.float64] * 4), types.CPointer(types.float64))
    compiled = numba.cfunc(signature)(scope["adapter"])
    _alive.append(compiled)
    return compiled.address
