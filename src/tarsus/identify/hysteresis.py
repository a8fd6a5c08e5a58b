"""Static loops -> the drive's hysteresis operator, and how its force is shared out over the structure.

``K x = load F(V)``, equation (2.8) for any linear structure, with F of the form of
`tarsus.model.drive.laws.prandtl_ishlinskii`. All parameters of F are linear, so that loops are a linear
least-squares problem. Where the foot stands on the ground the combination of points counts that the ground's
force does not move. Displacements are known from the rest after poling only; the neutral position, and with
it the constant of F, follows from the gap: the foot at rest is at ``-gap - level``, where ``level`` is the
place of the contact as seen from the rest."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from tarsus.base.arrays import Floats
from tarsus.base.errors import InputError
from tarsus.identify.draws import DRAWS, carried, newton_draws
from tarsus.identify.estimates import Estimates
from tarsus.identify.foot import FootModel
from tarsus.identify.loops import Block, Centred, across, basis_of, blocks_of, calmed, law_names
from tarsus.identify.step import Panel, Residual, StepResult, Used, measured_and_fitted
from tarsus.identify.traces import Trace
from tarsus.identify.volts import Volts
from tarsus.model.drive.laws import PrandtlIshlinskii
from tarsus.records.excluded import Excluded

_INDEPENDENT = 1e-3
"""Part of the gains that a combination of points must keep when the ground holds the foot: below, it says nothing of
the drive."""
_RIDGE = 1e-13
"""Share of the diagonal that keeps plays which never move from making the equations singular; rounding is 1e-16."""
_STEPS = 3
"""Newton's steps for participations, which are known to a percent or so beforehand: its square squared is rounding."""
_FEWEST = 50
"""Samples of static records: some for each of a dozen parameters."""


@dataclass(frozen=True)
class Shares:
    """Participations of the coordinates but the first in a modal load (n - 1,), as known before the loops, with their
    covariance (n - 1, n - 1) and draws (draws, n - 1); that of the first is the unit of the drive's force. Of a load at
    points, which is known, there are none."""

    values: Floats
    covariance: Floats
    draws: Floats

    @classmethod
    def none(cls) -> Shares:
        """Of a load at points."""
        return cls(np.zeros(0), np.zeros((0, 0)), np.zeros((DRAWS, 0)))


@dataclass(frozen=True)
class Loops:
    """Static records by block, apart for free and held foot.

    traces: the records, those in the air without their ringing; rest (p,): the basis at rest; blocks; free, held: their
    samples; noise (np,) [m]: standard deviation of a sample, the same for all blocks; unused (nt): samples left out
    around contacts, by trace."""

    traces: tuple[Trace, ...]
    rest: Floats
    blocks: tuple[Block, ...]
    free: Centred
    held: Centred
    noise: Floats
    unused: tuple[int, ...]

    def seen(self, model: FootModel) -> list[tuple[Centred, Floats]]:
        """Samples with the combination of points (np,), over their noise, by which each shows the force: with the foot
        held the one that the ground's force does not move, where the drive moves it."""
        gains, blind = model.by_drive / self.noise, across(model.by_contact / self.noise)
        left = blind @ gains
        if np.linalg.norm(left) <= _INDEPENDENT * np.linalg.norm(gains):
            return [(self.free, gains)]
        return [(self.free, gains), (self.held, left @ blind)]


@dataclass(frozen=True)
class LoopFit:
    """The drive as the loops show it.

    paths (p,), values (p,): participations but the first of a modal load, then the parameters of the law; own (draws,
    p): deviations over blocks.
    """

    loops: Loops
    model: FootModel
    level: float
    shares: Shares
    paths: tuple[str, ...]
    values: Floats
    own: Floats

    def again(self, model: FootModel, level: float, shares: Floats) -> Floats:
        """Parameters (p,) for another structure [of the model], contact level [m] and known shares (n - 1,)."""
        return _estimate(model, self.loops, level, replace(self.shares, values=shares))


def fit_loops(
    model: FootModel, traces: Sequence[Trace], level: float | None, shares: Shares, seed: int
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
        What is known of a modal load.
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
    values = _estimate(model, loops, neutral, shares)
    # ringing is a hundredth of the motion at most, so that a first estimate of the drive is enough to tell it
    calm = [calmed(_with(model, values, shares), trace) for trace in traces]
    loops = _gathered(model, calm, level)
    values = _estimate(model, loops, neutral, shares)
    return LoopFit(
        loops, model, neutral, shares, _paths(model, shares), values, _own(model, loops, shares, values, seed)
    )


def _paths(model: FootModel, shares: Shares) -> tuple[str, ...]:
    before = f"robot.drives.{model.drive}"
    own = (f"{before}.load.participation.{k + 1}" for k in range(len(shares.values)))
    return (*own, *(f"{before}.law.{name}" for name in law_names(model.law)))


def _gathered(model: FootModel, traces: Sequence[Trace], level: float | None) -> Loops:
    if not traces:
        raise InputError("there is no static record to identify the drive's law from")
    found = [blocks_of(trace, model.foot_point, level if trace.gap is None else None) for trace in traces]
    blocks = [block for those, _ in found for block in those]
    if sum(len(block.index) for block in blocks) < _FEWEST:
        raise InputError(
            "the static records have hardly any sample away from the making and breaking of contacts"
        )
    noise = np.sqrt(np.mean([trace.noise_x**2 for trace in traces], axis=0))
    bases = [basis_of(model.law, trace.volts, model.history) for trace in traces]
    of = np.repeat(
        [number for number, (those, _) in enumerate(found) for _ in those], [len(b.index) for b in blocks]
    )
    block = np.repeat(np.arange(len(blocks)), [len(b.index) for b in blocks])
    basis = np.concatenate([bases[n][b.index] for n, (those, _) in enumerate(found) for b in those])
    motion = np.concatenate([b.source.x[:, b.index].T for b in blocks])
    free = np.concatenate([b.free for b in blocks])
    air, ground = (Centred.of(basis[at], motion[at], block[at], of[at]) for at in (free, ~free))
    return Loops(
        tuple(traces), bases[0][0], tuple(blocks), air, ground, noise, tuple(left for _, left in found)
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


def _estimate(model: FootModel, loops: Loops, level: float, shares: Shares) -> Floats:
    found = _shared(model, loops, shares)
    return np.concatenate([found, _law(with_shares(model, found), loops, level)])


def _own(model: FootModel, loops: Loops, shares: Shares, values: Floats, seed: int) -> Floats:
    """Deviations (draws, p) by the scatter of the scores of blocks."""
    count, split = len(loops.blocks), len(shares.values)
    known, inside = with_shares(model, values[:split]), values[split + 1 :]
    rows = split + len(inside)
    information, score, prior = np.zeros((count, rows, rows)), np.zeros((count, rows)), np.zeros((rows, rows))
    if split:
        prior[:split, :split] = np.linalg.inv(shares.covariance)
        information[:, :split, :split], score[:, :split] = _about_shares(known, loops)
    size = np.ones(rows)
    size[split:] = np.sqrt(
        np.maximum(sum(np.diag(one.squares)[1:] * (w @ w) for one, w in loops.seen(known)), 1e-300)
    )
    prior[split:, split:] = _RIDGE * np.eye(len(inside))
    for one, w in loops.seen(known):
        basis = one.basis[:, 1:] / size[split:]
        left = one.motion @ (w / loops.noise) - (w @ w) * (one.basis[:, 1:] @ inside)
        information[:, split:, split:] += (w @ w) * one.by_block(basis[:, :, None] * basis[:, None], count)
        score[:, split:] += one.by_block(basis * left[:, None], count)
    moves = newton_draws(information, score, seed, prior) / size
    if split:
        given = values[:split]
        moves[:, split:] += carried(
            lambda s: _law(with_shares(model, s), loops, 0.0)[1:], given, given + moves[:, :split]
        )
    return np.insert(moves, split, -moves[:, split:] @ loops.rest[1:], axis=1)


def _with(model: FootModel, values: Floats, shares: Shares) -> FootModel:
    """The model with a drive as estimated: participations (n - 1,), if they are looked for, then the law's (p,)."""
    return model.changed(dict(zip(_paths(model, shares), values.tolist(), strict=True)))


def with_shares(model: FootModel, shares: Floats) -> FootModel:
    """The model with participations (n - 1,) after the first of its modal load."""
    before = f"robot.drives.{model.drive}.load.participation"
    return model.changed({f"{before}.{k + 1}": float(v) for k, v in enumerate(shares)})


def _shared(model: FootModel, loops: Loops, shares: Shares) -> Floats:
    """Participations (n - 1,) from what was known, and from the direction in which free points move together.

    The points' free motion is along ``by_drive``, linear in the participations; what lies across it is noise."""
    if not len(shares.values):
        return shares.values
    prior, found = np.linalg.inv(shares.covariance), shares.values
    for _ in range(_STEPS):
        information, score = _about_shares(with_shares(model, found), loops)
        matrix, target = information.sum(axis=0) + prior, score.sum(axis=0) + prior @ (shares.values - found)
        found = found + np.linalg.solve(matrix, target)
    return found


def _about_shares(model: FootModel, loops: Loops) -> tuple[Floats, Floats]:
    """Of each block information (nb, n - 1, n - 1) and score (nb, n - 1) about the model's participations: what is
    across the direction they give, against how far the block moves along it."""
    gains = model.by_drive / loops.noise
    per_share = (np.linalg.inv(model.stiffness).T @ model.rows.T / loops.noise)[1:]
    size = float(np.linalg.norm(gains))
    along, seen = gains / max(size, 1e-300), loops.free.motion / loops.noise
    aside = (per_share - np.outer(per_share @ along, along)) / max(size, 1e-300)
    path = seen @ along
    count = len(loops.blocks)
    moved = loops.free.by_block(path**2, count)
    return moved[:, None, None] * (aside @ aside.T), loops.free.by_block(
        path[:, None] * (seen @ aside.T), count
    )


def _law(model: FootModel, loops: Loops, level: float) -> Floats:
    """Parameters (p,) of the law by least squares."""
    matrix, target = np.zeros_like(loops.free.squares), np.zeros(len(loops.rest))
    for one, weights in loops.seen(model):
        matrix += one.squares * float(weights @ weights)
        target += one.cross @ (weights / loops.noise)
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
    shares: Shares,
    seed: int,
) -> StepResult:
    """The step: `fit_loops`, with draws over blocks and of everything the loops rely on.

    known: what was found before, the structure, with draws; level: with its standard error [m]. The others, and what is
    raised, are as `fit_loops` has them.
    """
    at = None if level is None else level[0]
    fit = fit_loops(known.model(), traces, at, shares, seed)
    count, split = len(known.values), len(known.values) + 1
    random = np.random.default_rng([seed, 7])
    moved = fit.level + (0.0 if level is None else level[1]) * random.standard_normal(DRAWS)
    before = np.concatenate([known.samples, moved[:, None], shares.draws], axis=1)

    def again(values: Floats) -> Floats:
        return fit.again(known.model(values[:count]), float(values[count]), values[split:])

    from_before = carried(again, np.concatenate([known.values, [fit.level], shares.values]), before)
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
        taken=() if level is not None else fit.paths[len(shares.values) :][:1],
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
            label, noise = f"{trace.file}, {point} in the air", float(trace.noise_x[k])
            residuals.append(Residual.of(label, "m", rest - rest.mean(), noise))
            if number == 0:
                volts = trace.volts[index]
                for title, shown, axis in (
                    (f"{point}, foot in the air", fitted, f"{point} from rest"),
                    (f"{point}, what the fit leaves", 0.0 * fitted, point),
                ):
                    panels.append(measured_and_fitted(title, ("voltage", "V", axis, "m"), volts, shown, rest))
    return tuple(panels), tuple(residuals)
