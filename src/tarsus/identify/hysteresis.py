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
from tarsus.identify.covariance import scattered
from tarsus.identify.draws import DRAWS, carried, drawn_level
from tarsus.identify.estimates import Estimates
from tarsus.identify.foot import FootModel
from tarsus.identify.influence import BLOCK, EVENT, Influence, events_of, of_records
from tarsus.identify.loops import Block, across, basis_of, blocks_of, calmed, law_names, moments
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

    traces: the records, those in the air without their ringing; rest (p,): the basis at rest; blocks; free, held (nb, p
    + np, p + np): by block, second moments of the basis and of the points' motion [m]; noise (np,) [m]: standard
    deviation of a sample, the same for all blocks; unused (nt): samples left out around contacts, by trace."""

    traces: tuple[Trace, ...]
    rest: Floats
    blocks: tuple[Block, ...]
    free: Floats
    held: Floats
    noise: Floats
    unused: tuple[int, ...]

    def about_law(self, model: FootModel, inside: Floats) -> tuple[Floats, Floats]:
        """Of each block information (nb, p - 1, p - 1) and score (nb, p - 1) about the parameters of the law but the
        constant, at values of these: the force as each combination of points over their noise shows it, with the foot
        held the one that the ground's force does not move, where the drive moves it."""
        gains, blind = model.by_drive / self.noise, across(model.by_contact / self.noise)
        left = blind @ gains
        seen = [(self.free, gains)]
        if np.linalg.norm(left) > _INDEPENDENT * np.linalg.norm(gains):
            seen.append((self.held, left @ blind))
        size = len(self.rest)
        information = sum((w @ w) * one[:, 1:size, 1:size] for one, w in seen)
        score = sum(one[:, 1:size, size:] @ (w / self.noise) for one, w in seen) - information @ inside
        return np.asarray(information), np.asarray(score)

    def about_shares(self, model: FootModel, shares: Floats) -> tuple[Floats, Floats]:
        """Of each block information (nb, n - 1, n - 1) and score (nb, n - 1) about participations (n - 1,) of a modal
        load: what is across the direction in which they move free points, against how far the block moves along it.

        The points' free motion is along ``by_drive``, linear in the participations; what lies across it is noise."""
        per_share, own = model.by_coordinates / self.noise, slice(len(self.rest), None)
        gains, per_share = np.append(model.load[0], shares) @ per_share, per_share[1:]
        size = max(float(np.linalg.norm(gains)), 1e-300)
        along = gains / size
        aside = (per_share - np.outer(per_share @ along, along)) / size
        path = self.free[:, own, own] / np.outer(self.noise, self.noise) @ along
        return (path @ along)[:, None, None] * (aside @ aside.T), path @ aside.T


@dataclass(frozen=True)
class LoopFit:
    """The drive as the loops show it.

    model: the device with it; paths (p,), values (p,): participations but the first of a modal load, then the
    parameters of the law; own (draws, p): deviations over blocks; influence: of the blocks, on all but the law's
    constant.
    """

    loops: Loops
    model: FootModel
    paths: tuple[str, ...]
    values: Floats
    own: Floats
    influence: Influence


def fit_loops(model: FootModel, traces: Sequence[Trace], level: float | None, shares: Shares, seed: int) -> LoopFit:
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
    bases = [basis_of(model.law, trace.volts, model.history) for trace in traces]
    loops = _gathered(model, traces, bases, level)
    at = neutral(model) if level is None else level
    _check_reach(model, traces)
    values = _estimate(model, loops, at, shares)
    # ringing is a hundredth of the motion at most, so that a first estimate of the drive is enough to tell it
    calm = [calmed(_with(model, values, shares), trace) for trace in traces]
    loops = _gathered(model, calm, bases, level)
    values = _estimate(model, loops, at, shares)
    influence, prior = _influence(model, loops, shares, values)
    own = _own(model, loops, shares, values, scattered(influence, seed, prior) * influence.units)
    return LoopFit(loops, _with(model, values, shares), _paths(model, shares), values, own, influence)


def neutral(model: FootModel) -> float:
    """Contact level [m] of a device whose rest is neutral."""
    return -model.gap * model.normal


def _paths(model: FootModel, shares: Shares) -> tuple[str, ...]:
    before = f"robot.drives.{model.drive}"
    own = (f"{before}.load.participation.{k + 1}" for k in range(len(shares.values)))
    return (*own, *(f"{before}.law.{name}" for name in law_names(model.law)))


def _gathered(model: FootModel, traces: Sequence[Trace], bases: Sequence[Floats], level: float | None) -> Loops:
    if not traces:
        raise InputError("there is no static record to identify the drive's law from")
    found = [blocks_of(trace, model.foot_point, level if trace.gap is None else None) for trace in traces]
    blocks = [block for those, _ in found for block in those]
    if sum(len(block.index) for block in blocks) < _FEWEST:
        raise InputError("the static records have hardly any sample away from the making and breaking of contacts")
    noise = np.sqrt(np.mean([trace.noise_x**2 for trace in traces], axis=0))
    of = np.repeat([number for number, (those, _) in enumerate(found) for _ in those], [len(b.index) for b in blocks])
    block = np.repeat(np.arange(len(blocks)), [len(b.index) for b in blocks])
    basis = np.concatenate([bases[n][b.index] for n, (those, _) in enumerate(found) for b in those])
    motion = np.concatenate([b.source.x[:, b.index].T for b in blocks])
    free = np.concatenate([b.free for b in blocks])
    rows = np.hstack([basis, motion])
    air, ground = (moments(rows[at], block[at], of[at], len(blocks)) for at in (free, ~free))
    return Loops(tuple(traces), bases[0][0], tuple(blocks), air, ground, noise, tuple(left for _, left in found))


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
    """Participations (n - 1,) from what was known and from the free points, by Newton's steps, then the law's
    parameters (p,)."""
    found = shares.values
    prior = np.linalg.inv(shares.covariance)
    for _ in range(_STEPS if len(found) else 0):
        information, score = loops.about_shares(model, found)
        total = information.sum(axis=0) + prior
        found = found + np.linalg.solve(total, score.sum(axis=0) + prior @ (shares.values - found))
    return np.concatenate([found, _law(with_shares(model, found), loops, level)])


def _influence(model: FootModel, loops: Loops, shares: Shares, values: Floats) -> tuple[Influence, Floats]:
    """What each block says of the participations and of the law but for its constant, each number in units that its
    data tell it by; and what is known of them beforehand."""
    split, known = len(shares.values), with_shares(model, values[: len(shares.values)])
    law, by_law = loops.about_law(known, values[split + 1 :])
    size = np.sqrt(np.maximum(np.einsum("baa->a", law), 1e-300))
    rows = split + len(size)
    information, score, prior = (np.zeros((len(law), rows, rows)), np.zeros((len(law), rows)), np.zeros((rows, rows)))
    information[:, split:, split:], score[:, split:] = law / np.outer(size, size), by_law / size
    prior[split:, split:] = _RIDGE * np.eye(len(size))
    if split:
        information[:, :split, :split], score[:, :split] = loops.about_shares(known, values[:split])
        prior[:split, :split] = np.linalg.inv(shares.covariance)
    numbers = {id(trace): number for number, trace in enumerate(loops.traces)}
    places = [numbers[id(one.source)] for one in loops.blocks]
    levels, covariates = of_records(loops.traces, places)
    ways = [places[:k].count(place) for k, place in enumerate(places)]
    levels = {
        BLOCK: np.arange(len(places)),
        EVENT: events_of([one.source.set for one in loops.blocks], ways, 0.5),
    } | levels
    paths, units = _paths(model, shares), np.append(np.ones(split), 1.0 / size)
    return Influence((*paths[:split], *paths[split + 1 :]), information, score, units, levels, covariates), prior


def _own(model: FootModel, loops: Loops, shares: Shares, values: Floats, moves: Floats) -> Floats:
    """Deviations (draws, p) by those of all but the constant as the blocks scatter (draws, p - 1)."""
    split = len(shares.values)
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


def _law(model: FootModel, loops: Loops, level: float) -> Floats:
    """Parameters (p,) of the law by least squares, scaled."""
    matrix, target = (one.sum(axis=0) for one in loops.about_law(model, np.zeros(len(loops.rest) - 1)))
    size = np.sqrt(np.maximum(np.diag(matrix), 1e-300))
    scaled = matrix / np.outer(size, size) + _RIDGE * np.eye(len(size))
    inside = np.linalg.solve(scaled, target / size) / size
    at_rest = (-model.gap - model.normal * level) / model.static_load
    return np.concatenate([[at_rest - float(loops.rest[1:] @ inside)], inside])


def identify_hysteresis(
    known: Estimates, traces: Sequence[Trace], level: tuple[float, float] | None, shares: Shares, seed: int
) -> StepResult:
    """The step: `fit_loops`, with draws over blocks and of everything the loops rely on.

    known: what was found before, the structure, with draws; level: with its standard error [m]. The others, and what is
    raised, are as `fit_loops` has them.
    """
    model, count = known.model(), len(known.values)
    fit = fit_loops(model, traces, None if level is None else level[0], shares, seed)
    at = level or (neutral(model), 0.0)
    before = np.concatenate([known.samples, drawn_level(at, seed)[:, None], shares.draws], axis=1)

    def again(values: Floats) -> Floats:
        moved = replace(shares, values=values[count + 1 :])
        return _estimate(known.model(values[:count]), fit.loops, float(values[count]), moved)

    from_before = carried(again, np.concatenate([known.values, at[:1], shares.values]), before)
    panels, residuals = _shown(fit)
    samples = sum(len(block.index) for block in fit.loops.blocks)
    gap, constant = model.gap, fit.values[len(shares.values)]
    notes = (
        f"The force offset assumes a {1e6 * gap:.4g} um gap; a 1 % gap error changes it by "
        f"{abs(gap / (fit.model.static_load * constant)):.2g} %.",
    )
    if level is None:
        notes = (
            "No record shows the ground, so that the neutral position is not known: the rest is taken to "
            "be neutral, and the constant of the law follows from that.",
        )
    left = tuple(
        Excluded(trace.file, "", "samples just after contacts were made or broken: the structure still rings", count)
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
        influence=fit.influence,
    )


def _shown(fit: LoopFit) -> tuple[tuple[Panel, ...], tuple[Residual, ...]]:
    """Loops measured and fitted, as the motion of the foot and of the point that moves most on the ground."""
    model, panels, residuals = fit.model, [], []
    for number, trace in enumerate(fit.loops.traces):
        blocks = [b for b in fit.loops.blocks if b.source is trace]
        index = np.sort(np.concatenate([b.index[b.free] for b in blocks]))
        force = Volts.of(trace.volts, 1).force(model.law, model.history)
        force = force - force[0]
        for k, point in enumerate(model.points):
            fitted = model.by_drive[k] * force[index]
            rest = trace.x[k, index] - fitted
            label, noise = f"{trace.file}, {point} in the air", float(trace.noise_x[k])
            residuals.append(Residual.of(label, "m", rest - rest.mean(), noise))
            if number == 0:
                axes = ("voltage", "V", f"{point} from rest", "m")
                title = f"{point}, foot in the air"
                panels.append(measured_and_fitted(title, axes, trace.volts[index], fitted, rest))
    return tuple(panels), tuple(residuals)
