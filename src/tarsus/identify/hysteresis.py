"""Static loops -> the drive's hysteresis operator, and how its force is shared out over the structure.

``K x = load F(V)``, equation (2.8) for any linear structure, with F of the form of
`tarsus.model.drive.laws.prandtl_ishlinskii`. All parameters of F are linear, so that loops are a linear
least-squares problem. Where the foot stands on the ground the combination of points counts that the ground's
force does not move. Displacements are known from the rest after poling only; the neutral position, and with
it the constant of F, follows from the gap: the foot at rest is at ``-gap - level``, where ``level`` is the
place of the contact as seen from the rest."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from tarsus.base.errors import InputError
from tarsus.identify.draws import DRAWS, carried, drawn_counts, student
from tarsus.identify.estimates import Estimates
from tarsus.identify.foot import FootModel
from tarsus.identify.loops import Block, Sums, across, basis_of, blocks_of, law_paths, law_with
from tarsus.identify.ringing import calmed
from tarsus.identify.step import Panel, Residual, StepResult, Used, measured_and_fitted
from tarsus.identify.traces import Trace
from tarsus.identify.volts import Volts
from tarsus.model.drive.laws import PrandtlIshlinskii
from tarsus.model.scene import ModalLoad
from tarsus.records.excluded import Excluded

Floats = NDArray[np.float64]

_INDEPENDENT = 1e-3
"""Part of the gains that a combination of points must keep when the ground holds the foot: below, it says nothing of
the drive."""
_RIDGE = 1e-13
"""Share of the diagonal that keeps plays which never move from making the equations singular; rounding is 1e-16."""
_FEWEST = 50
"""Samples of static records: some for each of a dozen parameters."""


@dataclass(frozen=True)
class Shares:
    """Participations of the coordinates but the first in a modal load (n - 1,), as known before the loops, with their
    covariance (n - 1, n - 1); that of the first is the unit of the drive's force."""

    values: Floats
    covariance: Floats


@dataclass(frozen=True)
class Loops:
    """Static records as sums over blocks, apart for free and held foot, by trace.

    traces: the records, without the ringing of those in the air; rest (p,): the basis at rest; blocks; free, held:
    one of each a block; trace (nb,): number of the block's trace; noise (np,) [m]: standard deviation of a sample,
    the same for all blocks; unused (nt): samples left out around contacts, by trace."""

    traces: tuple[Trace, ...]
    rest: Floats
    blocks: tuple[Block, ...]
    free: tuple[Sums, ...]
    held: tuple[Sums, ...]
    trace: NDArray[np.intp]
    noise: Floats
    unused: tuple[int, ...]

    @cached_property
    def _stacked(self) -> tuple[Sums, Sums, Floats]:
        """All blocks of the free and of the held foot, and which trace they are of (nt, nb)."""
        of = (np.unique(self.trace)[:, None] == self.trace).astype(float)
        return Sums.stacked(self.free), Sums.stacked(self.held), of

    def pooled(self, counts: Floats) -> tuple[Sums, Sums]:
        """Sums of the free and of the held foot over drawn blocks (nb,), centred trace by trace."""
        free, held, of = self._stacked
        weights = of * counts
        return free.weighed(weights).centred(), held.weighed(weights).centred()


@dataclass(frozen=True)
class LoopFit:
    """The drive as the loops show it.

    paths (p,), values (p,): participations but the first of a modal load, then the parameters of the law; own (draws,
    p): deviations over drawn blocks.
    """

    loops: Loops
    model: FootModel
    level: float
    shares: Shares | None
    paths: tuple[str, ...]
    values: Floats
    own: Floats

    def again(self, model: FootModel, level: float, shares: Floats | None) -> Floats:
        """Parameters (p,) for another structure [of the model], contact level [m] and known shares (n - 1,)."""
        known = None if self.shares is None or shares is None else Shares(shares, self.shares.covariance)
        return _estimate(model, self.loops, level, known, np.ones(len(self.loops.blocks)))


def fit_loops(
    model: FootModel, traces: Sequence[Trace], level: float | None, shares: Shares | None, seed: int
) -> LoopFit:
    """Fit the drive's law, and its participations, to static records.

    Parameters
    ----------
    model
        The device with its structure as identified; of its law only the kind, the thresholds and the history are
        used.
    traces
        Records with a slow drive (repeats).
    level
        Contact level of the foot from the rest [m]; None if it never touches: then the rest is taken as neutral.
    shares
        What is known of a modal load; None for a load at points, which is known.
    seed
        Of the draws.

    Raises
    ------
    InputError
        If there are too few samples, or the voltage does not move through all plays of the law.
    """
    loops = _gathered(model, traces, level)
    neutral = -model.gap * model.normal if level is None else level
    _check_reach(model, traces)
    count = len(loops.blocks)
    values = _estimate(model, loops, neutral, shares, np.ones(count))
    # ringing is a hundredth of the motion at most, so that a first estimate of the drive is enough to tell it
    calm = [calmed(_with(model, values, shares), trace) for trace in traces]
    loops = _gathered(model, calm, level)
    values = _estimate(model, loops, neutral, shares, np.ones(count))
    drawn = drawn_counts(count, seed)
    own = np.array([_estimate(model, loops, neutral, shares, one) for one in drawn]) - values
    return LoopFit(loops, model, neutral, shares, _paths(model, shares), values, own * student(float(count)))


def _paths(model: FootModel, shares: Shares | None) -> tuple[str, ...]:
    before = f"robot.drives.{model.drive}.load.participation"
    own = () if shares is None else tuple(f"{before}.{k + 1}" for k in range(len(shares.values)))
    return (*own, *law_paths(model.law, model.drive))


def _gathered(model: FootModel, traces: Sequence[Trace], level: float | None) -> Loops:
    if not traces:
        raise InputError("there is no static record to identify the drive's law from")
    blocks: list[Block] = []
    numbers: list[int] = []
    unused: list[int] = []
    for number, trace in enumerate(traces):
        found, left = blocks_of(trace, model.foot_point, level if trace.gap is None else None)
        blocks += found
        numbers += [number] * len(found)
        unused.append(left)
    if sum(len(block.index) for block in blocks) < _FEWEST:
        raise InputError(
            "the static records have hardly any sample away from the making and breaking of contacts"
        )
    noise = np.sqrt(np.mean([trace.noise_x**2 for trace in traces], axis=0))
    free, held = [], []
    bases = [basis_of(model.law, Volts.of(trace.volts, 1), model.history) for trace in traces]
    for block, number in zip(blocks, numbers, strict=True):
        basis = bases[number][block.index]
        motion = block.source.x[:, block.index].T
        free.append(Sums.of(basis[block.free], motion[block.free]))
        held.append(Sums.of(basis[~block.free], motion[~block.free]))
    rest = bases[0][0]
    return Loops(
        tuple(traces), rest, tuple(blocks), tuple(free), tuple(held), np.array(numbers), noise, tuple(unused)
    )


def _check_reach(model: FootModel, traces: Sequence[Trace]) -> None:
    """Raise InputError where the largest loop is too small to move the widest play."""
    if not isinstance(model.law, PrandtlIshlinskii) or not model.law.thresholds:
        return
    span = max(float(np.ptp(trace.volts)) for trace in traces)
    widest = max(model.law.thresholds)
    if span < 2.0 * widest:
        names = ", ".join(sorted({trace.file for trace in traces}))
        raise InputError(
            f"{names}: the voltage spans {span:.3g} V, and the law's widest play of threshold {widest:.3g} "
            "V moves only in "
            f"loops of more than {2.0 * widest:.3g} V: record a wider loop, or take narrower plays"
        )


def _estimate(model: FootModel, loops: Loops, level: float, shares: Shares | None, counts: Floats) -> Floats:
    free, held = loops.pooled(counts)
    found = np.zeros(0)
    if shares is not None:
        found = _shared(model, loops, free, shares)
        model = with_shares(model, found)
    return np.concatenate([found, _law(model, loops, free, held, level)])


def _with(model: FootModel, values: Floats, shares: Shares | None) -> FootModel:
    """The model with a drive as estimated: participations (n - 1,), if they are looked for, then the law's (p,)."""
    if shares is not None:
        model = with_shares(model, values[: len(shares.values)])
    law = law_with(model.law, values[0 if shares is None else len(shares.values) :])
    return model.changed({f"robot.drives.{model.drive}.law": law})


def with_shares(model: FootModel, shares: Floats) -> FootModel:
    """The model with participations (n - 1,) after the first of its modal load."""
    before = f"robot.drives.{model.drive}.load.participation"
    return model.changed({f"{before}.{k + 1}": float(v) for k, v in enumerate(shares)})


def _shared(model: FootModel, loops: Loops, free: Sums, shares: Shares) -> Floats:
    """Participations (n - 1,) from what was known, and from the direction in which free points move together.

    The points' free motion is along ``by_drive``, linear in the participations; what lies across the direction seen
    is noise."""
    load = model.scene.robot.drives[model.drive].load
    assert isinstance(load, ModalLoad)
    spread = free.motions / np.outer(loops.noise, loops.noise)
    strength, directions = np.linalg.eigh(spread)
    per_share = np.linalg.solve(model.stiffness, np.eye(len(model.stiffness))).T @ model.rows.T
    per_share = per_share / loops.noise
    given = np.concatenate([[load.participation[0]], shares.values])
    size = float(np.linalg.norm(given @ per_share))
    if strength[-1] <= 0.0 or size <= 0.0:
        return shares.values
    off = directions[:, :-1].T * np.sqrt(strength[-1]) / size
    design = (off @ per_share.T)[:, 1:]
    target = -(off @ per_share.T)[:, 0] * load.participation[0]
    prior = np.linalg.inv(shares.covariance)
    return np.linalg.solve(design.T @ design + prior, design.T @ target + prior @ shares.values)


def _law(model: FootModel, loops: Loops, free: Sums, held: Sums, level: float) -> Floats:
    """Parameters (p,) of the law by least squares."""
    gains, felt = model.by_drive / loops.noise, model.by_contact / loops.noise
    matrix = free.squares * float(gains @ gains)
    target = (free.cross / loops.noise) @ gains
    blind = across(felt)
    left = blind @ gains
    if np.linalg.norm(left) > _INDEPENDENT * np.linalg.norm(gains):
        matrix = matrix + held.squares * float(left @ left)
        target = target + (held.cross / loops.noise) @ (blind.T @ left)
    inside = _solved(matrix[1:, 1:], target[1:])
    at_rest = (-model.gap - model.normal * level) / model.static_load
    return np.concatenate([[at_rest - float(loops.rest[1:] @ inside)], inside])


def _solved(matrix: Floats, target: Floats) -> Floats:
    """Least squares from normal equations (p, p), scaled."""
    size = np.sqrt(np.maximum(np.diag(matrix), 1e-300))
    scaled = matrix / np.outer(size, size) + _RIDGE * np.eye(len(size))
    return np.linalg.solve(scaled, target / size) / size


def identify_hysteresis(
    known: Estimates,
    traces: Sequence[Trace],
    level: tuple[float, float] | None,
    shares: Shares | None,
    share_draws: Floats,
    seed: int,
) -> StepResult:
    """The step: `fit_loops`, with draws over blocks and of everything the loops rely on.

    Parameters
    ----------
    known
        What was found before: the structure, with draws.
    traces
        Static records.
    level
        Contact level from the rest with its standard error [m]; None if the foot never touches.
    shares, share_draws
        Participations known before, with draws (draws, n - 1); None for a load at points.
    seed
        Of the draws.

    Raises
    ------
    InputError
        As `fit_loops`.
    """
    at = None if level is None else level[0]
    fit = fit_loops(known.model(), traces, at, shares, seed)
    count, split = len(known.values), len(known.values) + 1
    random = np.random.default_rng([seed, 7])
    moved = fit.level + (0.0 if level is None else level[1]) * random.standard_normal(DRAWS)
    given = np.zeros(0) if shares is None else shares.values
    before = np.concatenate([known.samples, moved[:, None], share_draws], axis=1)

    def again(values: Floats) -> Floats:
        return fit.again(
            known.model(values[:count]), float(values[count]), values[split:] if len(given) else None
        )

    from_before = carried(again, np.concatenate([known.values, [fit.level], given]), before)
    panels, residuals = _shown(_with(fit.model, fit.values, shares), fit)
    samples = sum(len(block.index) for block in fit.loops.blocks)
    notes = ()
    if level is None:
        notes = (
            "No record shows the ground, so that the neutral position is not known: the rest is taken to "
            "be neutral, and the constant of the law follows from that.",
        )
    left = tuple(
        Excluded(
            trace.file,
            "",
            "samples just after contacts were made or broken: the structure still rings",
            count,
        )
        for trace, count in zip(traces, fit.loops.unused, strict=True)
        if count
    )
    return StepResult(
        "hysteresis",
        fit.paths,
        fit.values,
        fit.values + fit.own + from_before,
        residuals=residuals,
        used=(Used("samples of static records", samples, samples + sum(fit.loops.unused)),),
        left_out=left,
        panels=panels,
        notes=notes,
        files=frozenset(block.source.file for block in fit.loops.blocks),
        taken=() if level is not None else fit.paths[len(given) : len(given) + 1],
    )


def _shown(model: FootModel, fit: LoopFit) -> tuple[tuple[Panel, ...], tuple[Residual, ...]]:
    """Loops measured and fitted, as the motion of the foot and of the point that moves most on the ground."""
    panels, residuals = [], []
    for number, trace in enumerate(fit.loops.traces):
        blocks = [b for b in fit.loops.blocks if b.source is trace]
        index = np.sort(np.concatenate([b.index[b.free] for b in blocks]))
        force = Volts.of(trace.volts, 1).force(model.law, model.history, 0, len(trace.volts))
        force = force - force[0]
        for k, point in enumerate(model.points):
            fitted = model.by_drive[k] * force[index]
            rest = trace.x[k, index] - fitted
            residuals.append(
                Residual(
                    f"{trace.file}, {point} in the air",
                    "m",
                    float(np.sqrt(np.mean((rest - rest.mean()) ** 2))),
                    float(trace.noise_x[k]),
                    len(rest),
                )
            )
            if number == 0:
                volts = trace.volts[index]
                for title, shown, axis in (
                    (f"{point}, foot in the air", fitted, f"{point} from rest"),
                    (f"{point}, what the fit leaves", 0.0 * fitted, point),
                ):
                    panels.append(measured_and_fitted(title, ("voltage", "V", axis, "m"), volts, shown, rest))
    return tuple(panels), tuple(residuals)
