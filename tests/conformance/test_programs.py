"""A law's program against the plain Python that it was made from."""

from __future__ import annotations

import math
import pickle
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import tarsus as ts
from example_laws import EXAMPLES, OWN
from tarsus.base.errors import InputError
from tarsus.core import _native
from tarsus.model.laws import Law, LegElectrostatic, RestituteFirst
from tarsus.model.laws.program import Builder, Op, Program
from tarsus.model.laws.translate import translate

ROOT = Path(__file__).parents[2]
EXAMPLE = ts.load_laws(ROOT / "examples" / "laws" / "magnet.py")["magnet"]
LAWS: list[Law] = [*EXAMPLES, EXAMPLE()]
SCALE = {"gap": 1e-5, "gap_rate": 0.1, "volts": 10.0, "time": 1.0, "speed": 0.1, "age": 1e-2}


def points(law: Law, count: int = 203) -> np.ndarray:
    """Arguments (na, count) of a law: zero, tiny, and over the range that it is used in; no multiple of eight."""
    random = np.random.default_rng(4)
    rows = []
    for name in law.leading:
        row = random.uniform(0.0, 1.0, count) * SCALE.get(name, 1e-3)
        row[:3] = 0.0, 1e-300, 1e-12
        rows.append(random.permutation(row))
    return np.array(rows)


def values(program: Program, arguments: np.ndarray, parameters: tuple[float, ...] = ()) -> np.ndarray:
    """Values (k,), eight at a time."""
    return _native.evaluate(program.code, program.constants, np.ascontiguousarray(arguments), np.array(parameters))


def slopes(program: Program, arguments: np.ndarray, parameters: tuple[float, ...] = ()) -> np.ndarray:
    """Derivatives (na, k) by the arguments."""
    inputs = program.code, program.constants, np.ascontiguousarray(arguments), np.array(parameters)
    return _native.evaluate_slopes(*inputs)


def of(law: Law) -> Program:
    function = law.function()
    assert function is not None
    return translate(function, len(law.leading))


@pytest.mark.parametrize("law", LAWS, ids=lambda law: law.name())
def test_a_program_is_the_plain_law(law):
    arguments = points(law)
    plain = [law.function()(*point, *law.parameters()) for point in arguments.T]
    powers = type(law) in OWN.values()  # which Python rounds only once
    found = values(of(law), arguments, law.parameters())
    if isinstance(law, ts.laws.LegElectrostatic):  # log(1 + x) - x / (1 + x) cancels to a hundredth at |x| = 0.02
        np.testing.assert_allclose(found, plain, rtol=1e-13, atol=0.0)
    elif not powers:
        np.testing.assert_array_equal(found, plain)
    else:
        np.testing.assert_array_max_ulp(found, np.array(plain), maxulp=4)


@pytest.mark.parametrize("law", LAWS, ids=lambda law: law.name())
def test_its_derivatives_are_central_differences(law):
    inputs = np.maximum(points(law, 61), 1e-3 * np.array([[SCALE.get(n, 1e-3)] for n in law.leading]))
    found = slopes(of(law), inputs, law.parameters())
    for i, row in enumerate(inputs):
        step = np.zeros_like(inputs)
        step[i] = 1e-5 * np.abs(row)
        ahead, behind = inputs + step, inputs - step
        up = np.array([law.function()(*point, *law.parameters()) for point in ahead.T])
        down = np.array([law.function()(*point, *law.parameters()) for point in behind.T])
        expected = (up - down) / (ahead[i] - behind[i])
        size = np.abs(up / row) + np.abs(found[i])
        assert np.all(np.abs(found[i] - expected) <= 1e-8 * size), law.names()


def test_both_branches_of_the_leg_meet():
    law = ts.laws.LegElectrostatic(coefficient=2e-20, offset=1e-6, rest=1e-5)
    height = law.offset + law.rest
    gaps = law.rest + height * np.array([-0.02, -0.01, 0.0, 0.01, 0.02]) * (1.0 + 1e-12)
    arguments = np.vstack([gaps, np.zeros(5), np.full(5, 3.0), np.zeros(5)])
    rate = slopes(of(law), arguments, law.parameters())[0]
    assert np.all(np.isfinite(rate)) and np.all(np.diff(rate) < 0.0), "the attraction fades with the gap"
    off = values(of(law), arguments, (0.0, 1e-6, 1e-5))
    np.testing.assert_array_equal(off, 0.0)
    assert LegElectrostatic.force(1e-5, 0.0, 3.0, 0.0, 0.0, 1e-6, 1e-5) == 0.0


# ---- the language

FACTOR = 3
TABLE = (1.0, -0.5, 0.25)


def helper(x: float, power: float = 2.0, *, shift: float = 0.0) -> float:
    if x < 0.0:
        return -helper_of(x) + shift
    return x**power + shift


def helper_of(x: float) -> float:
    return x * FACTOR


def integer_powers(x, y):
    total = x**2 + x**3 - y**-2 + x**0 + x**8 / (y * y + 1) ** 4 + abs(x) ** 2.5 / (y * y + 1) ** 1.5
    return total + (y * y) ** 0.5 + (x * x + 1) ** -0.5


def general_powers(x, y):
    return (x * x + 0.1) ** y + 2.0**y + (y * y + 1.0) ** 1.7 + math.pow(x * x + 1, y) + pow(x * x + 1, 0.3)


def remainders(x, y):
    y += math.copysign(0.5, y)
    return x // y + 2 * (x % y) + 4 * (x // -0.3) + 8 * (-x % 0.7) + math.fmod(x, y) + 7 // 2 + 7 % -4


def branches(x, y):
    total = 0
    if x < 0.5 <= y:
        total += 1
    elif x > 2 or (y < 0 and x != 1):
        total -= y
        if x > 2.5:
            return total * 10
    else:
        inside = x * y
        total = inside if inside > 1 else inside**2
    total *= 2.0
    if y > 2.9:
        return -total
    return total


def returns_in_loops(x, y):
    guess = abs(x) + 1.0
    for _ in range(12):
        step = 0.5 * (guess - (x * x + 1.0) / guess)
        guess -= step
        if abs(step) < 1e-3:
            return guess
    return guess + y


def loops(x, y):
    total = 0.0
    for k in range(1, 6, 2):
        for j in range(k):
            total += x * k / (j + 1)
    for n, c in enumerate(TABLE, start=1):
        total = total * y + c * n
    a, (b, c) = x, (y, 2.0)
    a, b = b, a
    for p, q in zip(TABLE, reversed(TABLE), strict=True):
        total += a * p - b * q
    return total + c + len(TABLE) + TABLE[-1] + max(TABLE)


def functions(x, y):
    u = abs(x) + 0.1
    near = x / 4.0
    total = math.sqrt(u) + math.exp(-u) + math.expm1(x) + math.log(u) + math.log1p(u) + math.log2(u) + math.log10(u)
    total += math.log(u, 3.0) + math.sin(x) + math.cos(y) + math.tan(near) + math.asin(near) + math.acos(near)
    total += math.atan(x) + math.atan2(y, x) + math.sinh(x) + math.cosh(y) + math.tanh(x) + math.asinh(x)
    total += math.acosh(1.0 + u) + math.atanh(near) + math.erf(x) + math.erfc(y) + math.hypot(x, y)
    return total + math.copysign(u, y) + math.radians(x) + math.degrees(y) + math.fabs(x) + math.pi * math.e


def steps(x, y):
    total = math.floor(x) + math.ceil(y) * 2 + math.trunc(x * y) * 3 + round(x) * 5 + int(y) * 7
    total += math.isfinite(x) + math.isnan(y) * 2 + math.isinf(x) * 4 + bool(x) * 8 + (x < y) * 16
    return total + min(x, y, 1) * 0.5 + max(x, y) * 0.25 + float(x != y) + (x or y) + (x > 1 and y)


def helped(x, y):
    return helper(x) + helper(y, 3.0, shift=1.0) - helper(x * y)


def chained(x, y):
    return 1.0 if -1 < x <= y < 2 else (x if x > y else -y)


LANGUAGE = [
    integer_powers,
    general_powers,
    remainders,
    branches,
    returns_in_loops,
    loops,
    functions,
    steps,
    helped,
    chained,
]


def grid() -> np.ndarray:
    random = np.random.default_rng(8)
    return np.hstack([random.uniform(-3.0, 3.0, (2, 400)), [[0.5, 2.0, 1.0, 2.0, 3.0], [0.5, 2.0, 2.0, 1.0, 3.0]]])


@pytest.mark.parametrize("function", LANGUAGE, ids=lambda f: f.__name__)
def test_every_construct_means_what_it_means_in_python_and_has_its_derivative(function):
    arguments = grid()
    plain, program = np.array([function(*point) for point in arguments.T]), translate(function)
    np.testing.assert_allclose(values(program, arguments), plain, rtol=1e-13, atol=1e-13)
    arguments = arguments[:, :200]
    found = slopes(program, arguments)
    for i in range(2):
        step = np.zeros_like(arguments)
        step[i] = 1e-6
        up, down = (np.array([function(*p) for p in (arguments + s * step).T]) for s in (1, -1))
        smooth = np.abs(up - down) < 1e-2 * (1.0 + np.abs(up))  # not across a jump
        expected = (up - down) / 2e-6
        close = np.abs(found[i] - expected) <= 1e-5 * (1.0 + np.abs(expected) + np.abs(up))
        assert smooth.mean() > 0.9 and np.all(close[smooth])


def test_edges_are_infinities_not_errors():
    def divided(x, y):
        return x / y + math.sqrt(x) * 0.0

    found = values(translate(divided), np.array([[1.0, 0.0, -1.0, math.inf], [0.0, 0.0, 1.0, 2.0]]))
    assert found[0] == math.inf and np.isnan(found[1:]).all()

    def guarded(x, y):
        if y == 0:
            return x
        return 1 / y

    program = translate(guarded)
    np.testing.assert_array_equal(values(program, np.array([[3.0, 4.0], [0.0, 2.0]])), [3.0, 0.5])
    assert np.all(np.isfinite(slopes(program, np.array([[3.0, 4.0], [0.0, 2.0]]))))


@pytest.mark.parametrize("op", [Op.EXP, Op.LOG, Op.LOG1P])
def test_exponentials_and_logarithms_of_rows_are_right_to_the_last_place(op):
    builder = Builder(1, 0)
    program = builder.finish(builder.apply(op, builder.inputs[0]))
    random = np.random.default_rng(3)
    near, far = random.normal(size=4000), np.exp(random.uniform(-744.0, 709.0, 4000))
    special = [0.0, -0.0, 1.0, -1.0, -2.0, 5e-324, 2.2e-308, 1.7e308, math.inf, -math.inf, math.nan]
    x = np.concatenate([near, 1.0 + 1e-8 * near, 1e-9 * near, 300.0 * near, far, special])
    found = _native.evaluate(program.code, program.constants, x[None], np.zeros(0))
    with np.errstate(all="ignore"):
        expected = {Op.EXP: np.exp, Op.LOG: np.log, Op.LOG1P: np.log1p}[op](x)
        off = np.abs(found - expected) / np.spacing(np.abs(expected))
    assert np.all((off <= 1.0) | (found == expected) | (np.isnan(found) & np.isnan(expected)))


def test_minima_take_the_first_of_equals_and_pass_nan_on_as_python_does():
    def least(x, y):
        return min(x, y)

    def most(x, y):
        return max(x, y)

    arguments = np.array([[math.nan, 1.0, math.nan, 2.0], [1.0, math.nan, math.nan, 2.0]])
    for function in (least, most):
        plain = [function(*point) for point in arguments.T]
        np.testing.assert_array_equal(values(translate(function), arguments), plain)
        assert slopes(translate(function), arguments)[0, 3] == 1.0


# ---- as data


def test_the_core_numbers_operations_the_same():
    assert _native.operations() == [op.name for op in Op]


def test_a_program_is_data():
    program = of(LAWS[2])
    assert pickle.loads(pickle.dumps(program)) == program
    assert program == of(LAWS[2]) and hash(program) == hash(of(LAWS[2]))
    assert program != of(LAWS[1]) and len({program, of(LAWS[1]), of(LAWS[2])}) == 2
    assert program.code.flags.c_contiguous and not program.code.flags.writeable
    assert str(of(LAWS[0])).splitlines()[-1] == "r3 = divide r0, r2"


def test_a_list_that_is_no_program_is_refused():
    for code in ([], [[int(Op.ADD), 0, 1, 0]], [[99, 0, 0, 0]], [[int(Op.NEGATE), -1, 0, 0]]):
        with pytest.raises(InputError, match="a program is a list of known operations"):
            Program(np.array(code), np.zeros(0), 1, 0)
        if code:
            with pytest.raises(ValueError, match="of a program"):
                _native.evaluate(np.array(code, dtype=np.int32), np.zeros(0), np.zeros((1, 3)), np.zeros(0))


# ---- expressions at random

_LEAF = st.sampled_from(["x", "y", "0.5", "2", "-3.0", "1e-3", "k"])


def _larger(inner: st.SearchStrategy[str]) -> st.SearchStrategy[str]:
    pair = st.tuples(inner, inner)
    return st.one_of(
        st.tuples(pair, st.sampled_from("+-*")).map(lambda t: f"({t[0][0]} {t[1]} {t[0][1]})"),
        pair.map(lambda t: f"({t[0]} / (abs({t[1]}) + 0.5))"),
        pair.map(lambda t: f"({t[0]} if {t[0]} < {t[1]} else -{t[1]})"),
        st.tuples(pair, st.sampled_from(["min", "max", "math.copysign", "math.atan2"])).map(
            lambda t: f"{t[1]}({t[0][0]}, {t[0][1]})"
        ),
        st.tuples(inner, st.sampled_from(["abs", "math.sin", "math.tanh", "math.floor", "-"])).map(
            lambda t: f"{t[1]}({t[0]})"
        ),
        inner.map(lambda t: f"math.sqrt(abs({t}))"),
        pair.map(lambda t: f"(({t[0]} <= {t[1]}) and {t[0]} or {t[1]})"),
        inner.map(lambda t: f"math.cos({t})"),
    )


@given(st.recursive(_LEAF, _larger, max_leaves=12), st.randoms(use_true_random=False))
def test_random_expressions(tmp_path_factory, expression, random):
    file = tmp_path_factory.mktemp("law") / "law.py"
    file.write_text(
        "import math\nfrom tarsus import SmoothLaw, quantity\n\n\nclass A(SmoothLaw):\n"
        "    k: float = quantity('1', 'k', default=1.5)\n\n    def force(x, y, volts, time, k):\n"
        f"        return float({expression})\n"
    )
    function = ts.load_laws(file)["a"].function()
    arguments = np.array([[random.uniform(-2.0, 2.0) for _ in range(5)] for _ in range(4)])
    plain = [function(*point, 1.5) for point in arguments.T]
    np.testing.assert_array_equal(values(translate(function, 4), arguments, (1.5,)), plain)


def test_the_landing_rule_is_a_program():
    program = translate(RestituteFirst.excess, 1)
    np.testing.assert_array_equal(values(program, np.array([[1.0, 2.0]]), (1.5,)), [-0.5, 0.5])


def test_what_is_known_is_computed_as_python_does_and_done_once():
    def known(x):
        return x * (7 // 2 + 2**3 - 10 % 4) + x / 4.0 + (x * 9)

    program = translate(known)
    assert [Op(op) for op in program.code[:, 0]] == [Op.MULTIPLY, Op.MULTIPLY, Op.ADD, Op.ADD]
    assert sorted(program.constants) == [0.25, 9.0]

    def constant(x):
        return 2.0

    assert values(translate(constant), np.array([[1.0, 5.0]])).tolist() == [2.0, 2.0]

    def unchanged(x):
        return x

    assert values(translate(unchanged), np.array([[1.0, 5.0]])).tolist() == [1.0, 5.0]
