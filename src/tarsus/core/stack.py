"""Contact modes and their step tables stacked into the arrays of a kernel (numpy only)."""

from __future__ import annotations

import math

import numpy as np

from tarsus.core.arrays import Modes, Tables
from tarsus.core.blocks import block_exponential
from tarsus.core.flow import TERMS
from tarsus.core.modes import ContactMode, StepTables, step_tables
from tarsus.core.nodes import N

CLASSES = 36
REACH = 5.0  # largest |T| h over which the Taylor polynomial of the flow keeps 13 digits


def step_lengths(horizon: float) -> np.ndarray:
    """Step lengths (CLASSES,) [s]: the power of two at or above ``horizon`` and its halvings."""
    return 2.0 ** (math.ceil(math.log2(horizon)) - np.arange(CLASSES))


def taylor_terms(rate: float, lengths: np.ndarray) -> np.ndarray:
    """Terms (nk,) of exp(rate h) to 1e-17, 0 where the step is too long to land in by Taylor polynomial."""
    terms = np.zeros(len(lengths), dtype=np.int64)
    for k, h in enumerate(lengths):
        x = rate * h
        if x > REACH:
            continue
        count, size = N + 2, x ** (N + 2) / math.factorial(N + 2)
        while size > 1e-17 and count < TERMS:
            count += 1
            size *= x / count
        terms[k] = count
    return terms


class ModeBook:
    """The contact modes a run has met so far, with their tables; ``arrays()`` is what the kernel takes."""

    def __init__(self, lengths: np.ndarray) -> None:
        self.lengths = lengths
        self.modes: list[ContactMode] = []
        self.tables: list[StepTables] = []
        self._arrays: tuple[Modes, Tables] | None = None

    def add(self, mode: ContactMode) -> None:
        """Add a mode and its step tables. Shared use by threads needs a lock around ``add``."""
        tables = step_tables(mode, self.lengths)
        self.modes = [*self.modes, mode]
        self.tables = [*self.tables, tables]
        self._arrays = None

    def has(self, mask: int) -> bool:
        return any(mode.mask == mask for mode in self.modes)

    def arrays(self) -> tuple[Modes, Tables]:
        if self._arrays is None:
            self._arrays = (_stack_modes(self.modes), _stack_tables(self.lengths, self.modes, self.tables))
        return self._arrays


def _pad(parts: list[np.ndarray]) -> np.ndarray:
    shape = tuple(max(1, *(p.shape[d] for p in parts)) if len(parts) > 1 else max(1, parts[0].shape[d]) for d in range(parts[0].ndim))
    out = np.zeros((len(parts), *shape))
    for q, part in enumerate(parts):
        out[(q, *(slice(0, s) for s in part.shape))] = part
    return out


def _stack_modes(modes: list[ContactMode]) -> Modes:
    def block_rows(mode: ContactMode) -> np.ndarray:
        return mode.blocks.reshape(-1, 4).T

    def input_norm(mode: ContactMode) -> np.ndarray:
        nb = len(mode.blocks)
        return np.hypot(mode.inputs[:, :nb], mode.inputs[:, nb:])

    def each(name: str) -> np.ndarray:
        return _pad([getattr(mode, name) for mode in modes])

    levels, sways = zip(*(_levels(mode) for mode in modes), strict=True)
    return Modes(
        level=_pad(list(levels)),
        sway=_pad(list(sways)),
        mask=np.array([mode.mask for mode in modes], dtype=np.int64),
        nb=np.array([len(mode.blocks) for mode in modes], dtype=np.int64),
        blocks=_pad([block_rows(mode) for mode in modes]),
        input_norm=_pad([input_norm(mode) for mode in modes]),
        **{
            name: each(name)
            for name in (
                "inputs", "beta", "outputs", "feed", "feed_rate", "to_physical", "offset", "from_physical",
                "held", "held_feed", "jump", "mobility", "reaction", "side", "side_rate", "skew", "printed", "printed_feed",
                "printed_damping",
            )
        },
    )  # fmt: skip


def _levels(mode: ContactMode) -> tuple[np.ndarray, np.ndarray]:
    """How far outputs can go for ever under constant inputs, from y' = T y + inputs now.

    An output is c y(t) = c y - c T^-1 y' + c T^-1 exp(T t) y': level (m, 2nb) is c T^-1, and sway (m, nb) the largest
    norm of c T^-1 exp(T t) in each block, infinite for one without a place of rest.
    """
    nb, m = len(mode.blocks), len(mode.mobility)
    level, sway = np.zeros((m, 2, nb)), np.full((m, nb), np.inf)
    for b, block in enumerate(mode.blocks):
        if abs(np.linalg.det(block)) <= 1e-9 * np.abs(block).max() ** 2:
            continue
        level[:, :, b] = mode.outputs[:m].reshape(m, 2, nb)[:, :, b] @ np.linalg.inv(block)
        times = np.concatenate([[0.0], np.geomspace(1e-3, 1e3, 200)]) / np.abs(block).max()
        flow = block_exponential(block[None], times)[:, 0]
        sway[:, b] = 1.1 * np.linalg.norm(level[:, :, b] @ flow, axis=-1).max(axis=0)
    return level.reshape(m, 2 * nb), sway


def _stack_tables(lengths: np.ndarray, modes: list[ContactMode], tables: list[StepTables]) -> Tables:
    def rate(mode: ContactMode) -> float:
        return float(np.linalg.norm(mode.blocks, ord=2, axis=(1, 2)).max()) if len(mode.blocks) else 0.0

    terms = np.array([taylor_terms(rate(mode), lengths) for mode in modes], dtype=np.int64)
    names = (
        "exponential", "node_state", "node_input", "node_constant", "state_input", "state_constant", "envelope",
    )  # fmt: skip
    stacked = {name: _pad([getattr(t, name) for t in tables]) for name in names}
    return Tables(lengths=lengths, terms=terms, **stacked)
