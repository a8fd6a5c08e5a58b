"""Time of laws as programs: ns for the eight nodes of a step, with and without derivative.

    python benchmarks/programs.py

Best of many passes over 4000 rows of eight; a pass is independent evaluations, so that they overlap.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable

import numpy as np

from tarsus.core import _native
from tarsus.model.laws import Electrostatic, Film, LegElectrostatic
from tarsus.model.laws.translate import translate

ROWS, PASSES = 4000, 200


def twenty(x: float, y: float, a: float, b: float) -> float:
    """A law of twenty operations, one of them a division."""
    d = x + a
    s = d * d
    u = b / (s * d)
    v = u * y
    w = v * v + s
    r = w * b + v
    q = r - u * s
    t = q * q * b
    return t + r * w - q * (u + v) + d * w


def exponential(x: float, y: float, a: float, b: float) -> float:
    return -a * math.exp(-x / b)


CASES: list[tuple[str, Callable[..., float], int, list[float]]] = [
    ("film", Film.momentum, 1, [1.7e-21, 5e-6]),
    ("electrostatic", Electrostatic.force, 4, [2e-20, 1e-6]),
    ("electrostatic along a leg", LegElectrostatic.force, 4, [2e-20, 1e-6, 1e-5]),
    ("twenty operations", twenty, 2, [1.0, 2.0]),
    ("exponential", exponential, 2, [1.0, 1e-5]),
]


def best(action: Callable[[], object]) -> float:
    """Least time [ns] for one row of eight."""
    times = []
    for _ in range(PASSES):
        start = time.perf_counter()
        action()
        times.append(time.perf_counter() - start)
    return min(times) / ROWS * 1e9


def main() -> None:
    random = np.random.default_rng(1)
    print(f"{'law':28s}{'operations':>12s}{'value':>10s}{'derivative':>12s}   ns for 8")
    for name, function, leading, parameters in CASES:
        program = translate(function, leading)
        arguments = random.uniform(0.0, 1e-5, (leading, 8 * ROWS))
        inputs = program.code, program.constants, arguments, np.array(parameters)
        value = best(lambda inputs=inputs: _native.evaluate(*inputs))
        slopes = best(lambda inputs=inputs: _native.evaluate_slopes(*inputs)) / leading
        print(f"{name:28s}{len(program.code):12d}{value:10.1f}{slopes:12.1f}")


if __name__ == "__main__":
    main()
