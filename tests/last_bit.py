"""Linear algebra as another processor does it: every result moved by a random unit in its last place.

`install(seed)`, before tarsus is imported, moves what functions of numpy.linalg, scipy.linalg and tarsus.base.linear
return, element by element (the last makes the same bits everywhere: the engine must not lean on that): zeros stay
zeros, as structure leaves them zero on every machine. Products (``@`` in sources of tarsus, which are compiled with
them replaced) are moved by the rounding of their sums, the sum of |terms| times 2e-16: what cancels leaves something
else on another machine. A sum of one term is rounded alike everywhere and stays. What is asked twice is answered twice
alike, as by a processor. As an option of the tests: ``pytest --last-bit 1 tests/core``.
"""

from __future__ import annotations

import ast
import builtins
import functools
import sys
import zlib
from importlib.abc import MetaPathFinder
from importlib.machinery import ModuleSpec, SourceFileLoader
from typing import Any

import numpy as np

EPS = float(np.finfo(float).eps)
PRODUCT = "product_with_another_last_bit"
_STAY = ("norm", "LinAlgError", "LinAlgWarning", "test", "get_blas_funcs", "get_lapack_funcs", "find_best_blas_type")


_LINEAR = ("solve", "inverse", "cholesky", "eigh", "svd", "eig", "pseudoinverse", "modes_of")


def _flat(given: Any) -> list[np.ndarray]:
    """All arrays in lists and tuples, however deep."""
    if isinstance(given, list | tuple):
        return [array for one in given for array in _flat(one)]
    return [np.asarray(given)] if isinstance(given, np.ndarray | float | int | complex) else []


def same_for(seed: int, *given: Any) -> np.random.Generator:
    """Random numbers that are the same whenever the same is given."""
    arrays = [np.ascontiguousarray(one) for one in _flat(given)]
    sums = [zlib.crc32(one.tobytes()) for one in arrays if one.dtype.kind in "fciu"]
    return np.random.Generator(np.random.PCG64([seed, *sums]))


def moved(value: Any, rng: np.random.Generator) -> Any:
    """A result with every number of it at one of its neighbours or where it is; integers stay."""
    if isinstance(value, tuple):
        parts = [moved(part, rng) for part in value]
        return type(value)(*parts) if hasattr(value, "_fields") else tuple(parts)
    if not isinstance(value, np.ndarray | np.floating | np.complexfloating | float | complex):
        return value
    array = np.asarray(value)
    if array.dtype == np.complex128:
        return moved(array.real, rng) + 1j * moved(array.imag, rng)
    if array.dtype != np.float64:
        return value
    step = rng.integers(-1, 2, array.shape)
    with np.errstate(all="ignore"):  # a neighbour of the smallest number is no fault of who asked
        there = np.nextafter(array, np.where(step > 0, np.inf, -np.inf))
    out = np.where((step == 0) | (array == 0.0), array, there)
    return out if isinstance(value, np.ndarray) else out[()]


def product(a: Any, b: Any, seed: int) -> Any:
    """a @ b, moved within the rounding of its sums; of complex numbers, each part within its own."""
    out = a @ b
    if not isinstance(out, np.ndarray | np.floating | np.complexfloating) or out.dtype.kind not in "fc":
        return out
    rng = same_for(seed, a, b)
    left, right = np.abs(np.real(a)), np.abs(np.real(b))
    several = (np.asarray(a) != 0).astype(float) @ (np.asarray(b) != 0).astype(float) > 1.0
    by = EPS * np.where(several, left @ right, 0.0) * rng.uniform(-1.0, 1.0, np.shape(out))
    if out.dtype.kind == "c":
        across = left @ np.abs(np.imag(b)) + np.abs(np.imag(a)) @ right
        by = by + 1j * EPS * np.where(several, across, 0.0) * rng.uniform(-1.0, 1.0, np.shape(out))
    return out + by


def install(seed: int) -> None:
    """From now on: tarsus, which must not have been imported, and all who ask numpy and scipy by their modules."""
    assert "tarsus" not in sys.modules, "the products of modules that are loaded stay as they are"
    import scipy.linalg

    for module in (np.linalg, scipy.linalg):
        for name in module.__all__:
            given = getattr(module, name)
            if callable(given) and not isinstance(given, type) and name not in _STAY:
                setattr(module, name, _moving(given, seed))
    setattr(builtins, PRODUCT, functools.partial(product, seed=seed))
    sys.meta_path.insert(0, _Finder())


def _moving(function: Any, seed: int) -> Any:
    @functools.wraps(function)
    def called(*args: Any, **kwargs: Any) -> Any:
        return moved(function(*args, **kwargs), same_for(seed, *args))

    return called


class _Finder(MetaPathFinder):
    """Finds modules of tarsus where the others find them, and has them compiled here."""

    def find_spec(self, name: str, path: Any = None, target: Any = None) -> ModuleSpec | None:
        if name.partition(".")[0] != "tarsus":
            return None
        for finder in sys.meta_path:
            spec = finder.find_spec(name, path, target) if finder is not self else None
            if spec is not None:
                if spec.origin and spec.origin.endswith(".py"):
                    spec.loader = _Loader(name, spec.origin)
                return spec
        return None


class _Loader(SourceFileLoader):
    def get_code(self, fullname: str) -> Any:
        tree = _Products().visit(ast.parse(self.get_data(self.path), self.path))
        return compile(ast.fix_missing_locations(tree), self.path, "exec", dont_inherit=True)

    def exec_module(self, module: Any) -> None:
        super().exec_module(module)
        if module.__name__ == "tarsus.base.linear":
            two = getattr(builtins, PRODUCT)
            for name in _LINEAR:
                setattr(module, name, _moving(getattr(module, name), two.keywords["seed"]))
            module.product = lambda *factors: functools.reduce(two, factors)


class _Products(ast.NodeTransformer):
    def visit_BinOp(self, node: ast.BinOp) -> ast.AST:
        self.generic_visit(node)
        if not isinstance(node.op, ast.MatMult):
            return node
        name = ast.copy_location(ast.Name(PRODUCT, ast.Load()), node)
        return ast.copy_location(ast.Call(name, [node.left, node.right], []), node)
