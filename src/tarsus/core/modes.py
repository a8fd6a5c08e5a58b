"""Contact modes: the linear structure with some feet held on the ground, in a fixed order of operations; and the book of those
that runs of one structure have met.

A foot on the ground is held along its normal; one that knows the way along the ground (`LinearSystem.tangents`) slides
there, or sticks and is held along it too. With a set S of such constraints the structure is again linear. Its exact flow over a step of length h,
with every input a polynomial through its nodal values, is a handful of constant matrices; the native
engine makes them. Nothing here knows a law.

Inputs of a step, in this order (``ni = 2 m + nd + 1`` for m feet, nd drives):

    0 .. m-1      momentum potential P_i of the resistive (film) laws at foot i [N s]
    m .. 2m-1     of a foot in the air the smooth force F_i along its normal [N]; of one that slides the friction force along
                  the ground [N]; of one that sticks the place where it does [m]
    2m ..         drive forces [N]
    last          the constant 1 (gravity, static offset of held feet)

Only what belongs to that last input depends on the rest gaps and on gravity, and linearly: a contact mode keeps it per
unit of each of these sources (`Bias`), so that tables serve every rest gap and every gravity.

The flowing state w is the modal state less beta_i P_i, so a resistive force f = dP/dt enters through P only.
Outputs: 0 .. m-1 the gap [m] of a free foot or the structure's pull [N] on a held one; m .. 2m-1 the gap rate [m/s] of a free
foot, the rate along the ground [m/s] of one that slides, the structure's force along the ground [N] on one that sticks.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from functools import cached_property, partial
from threading import Lock
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tarsus.base.linear import cholesky, inverse, length, product, pseudoinverse, rank_of, solve, svd
from tarsus.core import _native, nodes
from tarsus.core.blocks import split_modes

Floats = NDArray[np.float64]

NODES = _native.Nodes(vars(nodes))

REDUNDANT = 1e-13
"""A foot whose mobility falls below this part by others that are held is held by them: rounding leaves 1e-16 of it."""


@dataclass(frozen=True)
class LinearSystem:
    """M x'' + C x' + K x = loads @ u + constant + normals @ f, gap = rest_gap + normals.T @ x, constant = weight @ gravity.

    mass, damping, stiffness (n, n); normals (n, m); rest_gap (m,) [m]; loads (n, nd); weight (n, 2) [kg]: constant forces
    per unit of gravity (2,) [m/s^2], into the ground and back along the way.
    directions (n, m): change of the velocities per unit change of a struck foot's rate, mass-weighted when absent.
    alone (n, m): coordinates that move a foot by one along its normal and no other point; for the pull as printed.
    tangents (n, m): place of each foot along the ground is tangents.T @ x; zeros for feet that do not know theirs, None where
    none does.
    """

    mass: Floats
    damping: Floats
    stiffness: Floats
    normals: Floats
    rest_gap: Floats
    loads: Floats
    weight: Floats
    gravity: Floats = field(default_factory=lambda: np.array([1.0, 0.0]))
    directions: Floats | None = None
    alone: Floats | None = None
    tangents: Floats | None = None

    @cached_property
    def constraints(self) -> Floats:
        """What feet can be held by (n, m or 2m): their normals, then the ways along the ground."""
        return self.normals if self.tangents is None else np.hstack([self.normals, self.tangents])

    @property
    def constant(self) -> Floats:
        """Constant forces (n,) [N]."""
        return product(self.weight, self.gravity)

    @property
    def sources(self) -> Floats:
        """What tables are made per unit of (m + 2,): rest gaps [m], gravity [m/s^2]."""
        return np.concatenate([self.rest_gap, self.gravity])

    @property
    def arrays(self) -> dict[str, Floats]:
        """What tables depend on, by name: all there is but the sources."""
        given = {name: getattr(self, name) for name in self.__dataclass_fields__ if name not in ("rest_gap", "gravity")}
        return {name: array for name, array in given.items() if array is not None}

    def at(self, sources: Floats) -> LinearSystem:
        """The same structure with other sources (m + 2,): rest gaps [m], gravity [m/s^2]."""
        return replace(self, rest_gap=sources[:-2], gravity=sources[-2:])

    @cached_property
    def per_impulse(self) -> Floats:
        """Change of the velocities (n, m or 2m) by a unit impulse on each foot, along its normal and along the ground."""
        return solve(self.mass, self.constraints)

    @cached_property
    def holdings(self) -> dict[tuple[int, ...], tuple[Floats, Floats, Floats, Floats]]:
        """Data of held constraints, once made: contact modes side by side share them."""
        return {}


@dataclass(frozen=True)
class Bias:
    """What one unit of every source adds to the last input's part of a contact mode's arrays; rows are sources."""

    inputs: Floats  # (m + 2, 2nb)
    feed: Floats  # (m + 2, 2m)
    offset: Floats  # (m + 2, 2n)
    held_feed: Floats  # (m + 2, m)
    printed_feed: Floats  # (m + 2, m)


@dataclass(frozen=True)
class ContactMode:
    """The structure with the constraints of ``mask`` held: bit i the normal of foot i, bit m + i its way along the ground;
    nb = number of 2 x 2 blocks, state size 2 nb. The last four arrays are empty without `LinearSystem.tangents`."""

    mask: int
    blocks: Floats  # (nb, 2, 2)
    basis: Floats  # (2nb, 2nb): motion of the held structure from the modal state, see `split_modes`
    inputs: Floats  # (ni, 2nb): w' = T w + inputs.T @ values
    beta: Floats  # (m, 2nb): change of the state by a unit impulse on each free foot
    outputs: Floats  # (2m, 2nb)
    feed: Floats  # (2m, ni): direct part of the outputs
    feed_rate: Floats  # (2m, ni): part of the outputs from the time derivative of an input
    to_physical: Floats  # (2n, 2nb): [x; v] = to_physical @ y + offset
    offset: Floats  # (2n,): zero until the mode is `biased`, like the last input's part of inputs and feeds
    from_physical: Floats  # (2nb, 2n): mass-weighted projection, i.e. also the plastic impact
    held: Floats  # (m, 2nb): pull on a free foot if it were stopped on the ground now
    held_feed: Floats  # (m, ni): its direct part, forces by their total value
    jump: Floats  # (m, 2nb): change of the state per unit change of the foot's gap rate
    mobility: Floats  # (m,) 1/kg
    reaction: Floats  # (m, m): impulse on held foot k per unit impulse on free foot i
    side: Floats  # (m, 2nb): change of the state by a unit velocity across the foot's normal, see _across
    side_rate: Floats  # (m, 2nb): that velocity
    skew: Floats  # (m,): velocity across per velocity along, of the foot's impact direction
    printed: Floats  # (m, 2nb): pull by (2.13) as printed on a free foot at the ground, without its own rate after the impact
    printed_feed: Floats  # (m, ni): its direct part
    printed_damping: Floats  # (m,) C_pp: its part of the rates before and after the impact
    leading: NDArray[np.int64]  # (r,) free feet whose gaps determine those of all others, see `_leading`
    spanned: Floats  # (m, r): gap of a free foot per unit of theirs, in addition to its gap at rest
    placed: Floats  # (m, n): displacements per unit of the place where a foot sticks
    slide: Floats  # (m, 2nb): change of the state by a unit impulse along the ground on a foot that does not stick
    slide_rate: Floats  # (m, 2nb): the rate along the ground of such a foot
    slide_feed: Floats  # (2m, m): force of the structure on what is held per unit force along the ground on such a foot
    bias: Bias

    @property
    def arrays(self) -> dict[str, NDArray[Any]]:
        """The mode as the engine takes it, by name."""
        given = {name: part for name, part in vars(self).items() if isinstance(part, np.ndarray)}
        return given | {f"bias.{name}": part for name, part in vars(self.bias).items()}

    def at_rest_there(self, tangents: Floats | None, physical: Floats) -> Floats:
        """Displacements and velocities (2n,) that have entered the mode: held feet at rest where they are."""
        n = len(physical) // 2
        offset = self.offset.copy()
        if tangents is not None:
            offset[:n] += product(product(tangents.T, physical[:n]), self.placed)
        return self.to_physical @ (self.from_physical @ (physical - offset)) + offset

    def biased(self, sources: Floats) -> ContactMode:
        """The mode with what these sources (m + 2,) add: rest gaps [m], gravity [m/s^2]."""
        inputs, feed = self.inputs.copy(), self.feed.copy()
        held_feed, printed_feed = self.held_feed.copy(), self.printed_feed.copy()
        inputs[-1] = product(sources, self.bias.inputs)
        feed[:, -1] = product(sources, self.bias.feed)
        held_feed[:, -1] = product(sources, self.bias.held_feed)
        printed_feed[:, -1] = product(sources, self.bias.printed_feed)
        return replace(
            self,
            inputs=inputs,
            feed=feed,
            held_feed=held_feed,
            printed_feed=printed_feed,
            offset=product(sources, self.bias.offset),
        )


def _apply(blocks: Floats, y: Floats) -> Floats:
    """T y for y (..., 2nb) stored as [first components, second components]; T a full matrix where blocks are."""
    nb = len(blocks)
    if blocks.ndim == 2:
        return product(y, blocks.T)
    a, b = y[..., :nb], y[..., nb:]
    return np.concatenate(
        [blocks[:, 0, 0] * a + blocks[:, 0, 1] * b, blocks[:, 1, 0] * a + blocks[:, 1, 1] * b], axis=-1
    )


def _holding(system: LinearSystem, held: list[int]) -> tuple[Floats, Floats, Floats, Floats]:
    """What `_hold` makes, made once."""
    key = tuple(held)
    found = system.holdings.get(key)
    if found is None:
        found = system.holdings[key] = _hold(system, held)
    return found


def _hold(system: LinearSystem, held: list[int]) -> tuple[Floats, Floats, Floats, Floats]:
    """Data of held constraints N (n, |S|): null basis Z, x per unit of their rest gaps (n, |S|), mass projector on Z, force
    rows W (|S|, n).

    W (external - C v - K x) is the structure's force on what holds each, for a normal the pull on its foot: the constraint
    force reversed, -lambda = (N^T M^-1 N)^-1 N^T M^-1 (external - C v - K x).
    """
    n = system.mass.shape[0]
    normals = system.constraints[:, held]
    if not held:
        return np.eye(n), np.zeros((n, 0)), np.eye(n), np.zeros((0, n))
    rows = normals.T
    sizes, ways = svd(rows)
    rank = rank_of(rows, math.sqrt(REDUNDANT), sizes)
    if rank == len(held) and _spread(system) > WIDE:
        z, placed = _graded(system, normals)
    else:
        z, seen = ways[:, rank:], ways[:, :rank] / sizes[:rank]
        placed = -product(seen, product(rows, seen).T)
    onto = product(z.T, system.mass)
    projector = solve(product(onto, z), onto) if z.shape[1] else np.zeros((0, n))
    minv_n = system.per_impulse[:, held]
    met = product(normals.T, minv_n)
    share = (
        pseudoinverse(met, REDUNDANT) if len(held) > 1 or not met.any() else 1.0 / met
    )  # a point that does not move carries nothing
    return z, placed, projector, product(share, minv_n.T)


WIDE = 1e3
"""Ratio of the fastest to the slowest rate of a structure's coordinates, beyond which the square of it times 1e-16, which
stiffnesses that mix them lose, is no longer negligible compared with 1e-10."""


def _rates(system: LinearSystem) -> Floats:
    """Rate (n,) [1/s] of each coordinate by itself."""
    return np.sqrt(np.maximum(system.stiffness.diagonal(), 0.0) / system.mass.diagonal())


def _spread(system: LinearSystem) -> float:
    rates = _rates(system)
    least = rates[rates > 0.0].min(initial=np.inf)
    return float(rates.max(initial=0.0) / least)


def _graded(system: LinearSystem, normals: Floats) -> tuple[Floats, Floats]:
    """Null basis Z of independent rows and x per unit of their rest gaps, in which the softest coordinates that carry the
    constraints follow the others: a stiff one is then in one column alone, and its stiffness in one entry."""
    n, count = normals.shape
    rates = _rates(system)
    softest, _ = _leading(normals / np.maximum(rates, 1e-3 * rates[rates > 0.0].min())[:, None])
    others = np.setdiff1d(np.arange(n), softest)
    z, placed = np.zeros((n, n - count)), np.zeros((n, count))
    z[others, np.arange(n - count)] = 1.0
    z[softest] = -solve(normals[softest].T, normals[others].T)
    placed[softest] = -inverse(normals[softest].T)
    return z, placed


def _inverse_basis(basis: Floats) -> Floats:
    """Inverse of a basis (2nb, 2nb), whose rows are counted by powers of two of their own sizes: elimination that chose between
    displacements and velocities as they are, in SI, would let an impulse displace a foot by the rounding of its speed."""
    size = np.exp2(np.round(np.log2(np.abs(basis).max(axis=1, initial=0.0, keepdims=True))))
    return inverse(basis / size) / size.T


def contact_mode(system: LinearSystem, mask: int) -> ContactMode:
    """The structure with the constraints whose bits are set in ``mask`` held, with its rest gaps and gravity."""
    return unbiased_mode(system, mask).biased(system.sources)


def unbiased_mode(system: LinearSystem, mask: int) -> ContactMode:
    """The structure with some constraints held, for any rest gaps and gravity: nothing of it depends on those of the system."""
    n, m = system.normals.shape
    constraints = system.constraints.shape[1]
    holding = [c for c in range(constraints) if mask >> c & 1]
    held, free = ([i for i in range(m) if (mask >> i & 1) == on] for on in (1, 0))
    z, placed, projector, rows = _holding(system, holding)
    mz, cz, kz = (product(z.T, part, z) for part in (system.mass, system.damping, system.stiffness))
    nz = z.shape[1]
    blocks, basis = split_modes(mz, cz, kz)
    onto = _inverse_basis(basis)
    position, velocity = product(z, basis[:nz]), product(z, basis[nz:])
    particular = np.zeros((n, m + 2))
    particular[:, held] = placed[:, : len(held)]
    constant = -product(system.stiffness, particular)  # forces per unit of every source
    constant[:, m:] = system.weight
    leading, spanned = np.zeros(0, np.int64), np.zeros((m, 0))
    if free:
        moves = product(z.T, system.normals[:, free])
        leading, share = _leading(solve(cholesky(mz), moves).T if len(free) > 1 else moves.T)
        spanned = np.zeros((m, len(leading)))
        spanned[free] = share
    both = np.zeros((2 * nz, 2 * n))
    both[:nz, :n], both[nz:, n:] = projector, projector
    mode = ContactMode(
        mask=mask,
        blocks=blocks,
        basis=basis,
        to_physical=np.vstack([position, velocity]),
        from_physical=product(onto, both),
        leading=np.array(free, dtype=np.int64)[leading],
        spanned=spanned,
        **_nothing(system, nz),
    )
    force_in = product(onto[:, nz:], solve(mz, z.T)) if nz else np.zeros((0, n))
    mode.inputs[2 * m : -1] = product(force_in, system.loads).T
    mode.bias.inputs[:] = product(force_in, constant).T
    mode.bias.offset[:, :n] = particular.T
    _add_free(mode, system, free, force_in, particular)
    _add_held(mode, system, holding, free, rows, constant)
    if system.tangents is not None:
        _add_along(mode, system, holding, free, rows, placed, force_in)
    springs = product(system.stiffness, position)
    for i in free:
        _add_stopped(mode, system, i, holding, springs, velocity, constant)
    if system.directions is not None:
        for i in np.flatnonzero(mode.mobility):
            across, mode.skew[i] = _across(
                mz, product(z.T, system.normals[:, i]), product(projector, system.directions[:, i])
            )
            mode.side[i] = product(onto[:, nz:], across)
            mode.side_rate[i] = product(across, mz, basis[nz:])
    if system.alone is not None:
        for i in np.flatnonzero(mode.mobility):
            _add_printed(mode, system, i, springs + product(system.damping, velocity), constant)
    return mode


def _nothing(system: LinearSystem, nz: int) -> dict[str, Any]:
    """Arrays of a contact mode of nz coordinates that are to be filled."""
    (n, m), nd, state = system.normals.shape, system.loads.shape[1], 2 * nz
    ni = 2 * m + nd + 1
    shapes = {
        "inputs": (ni, state),
        "beta": (m, state),
        "outputs": (2 * m, state),
        "feed": (2 * m, ni),
        "feed_rate": (2 * m, ni),
        "offset": (2 * n,),
        "held": (m, state),
        "held_feed": (m, ni),
        "jump": (m, state),
        "mobility": (m,),
        "reaction": (m, m),
        "side": (m, state),
        "side_rate": (m, state),
        "skew": (m,),
        "printed": (m, state),
        "printed_feed": (m, ni),
        "printed_damping": (m,),
    }
    ways = 0 if system.tangents is None else m
    shapes |= {"placed": (ways, n), "slide": (ways, state), "slide_rate": (ways, state), "slide_feed": (2 * ways, ways)}
    biases = {"inputs": state, "feed": 2 * m, "offset": 2 * n, "held_feed": m, "printed_feed": m}
    bias = Bias(**{name: np.zeros((m + 2, size)) for name, size in biases.items()})
    return {"bias": bias, **{name: np.zeros(shape) for name, shape in shapes.items()}}


def _add_free(mode: ContactMode, system: LinearSystem, free: list[int], force_in: Floats, particular: Floats) -> None:
    """What free feet do to the structure, and how they move with it."""
    m, n = len(mode.beta), len(system.mass)
    if not free:
        return
    feet, normals = np.array(free, dtype=np.intp), system.normals[:, free]
    beta, gap, rate = (
        product(force_in, normals).T,
        product(normals.T, mode.to_physical[:n]),
        product(normals.T, mode.to_physical[n:]),
    )
    drift, mobility = _apply(mode.blocks, beta), product(rate, beta.T).diagonal().copy()
    loose = mobility > REDUNDANT * product(normals.T, system.per_impulse[:, free]).diagonal()
    if not loose.all():  # held feet hold these as well: nothing moves them, and they move nothing
        mobility[~loose] = 0.0
        beta = np.ascontiguousarray(beta)
        for part in (beta, drift, gap, rate):
            part[~loose] = 0.0
    mode.beta[feet], mode.inputs[feet], mode.inputs[m + feet], mode.mobility[feet] = beta, drift, beta, mobility
    mode.outputs[feet], mode.outputs[m + feet] = gap, rate
    mode.feed[np.ix_(m + feet, feet)] = product(rate, beta.T)
    mode.bias.feed[:, feet] = product(normals.T, particular).T
    mode.bias.feed[feet, feet] += 1.0
    moved = feet[loose]
    mode.jump[moved] = beta[loose] / mobility[loose, None]


def _add_held(
    mode: ContactMode, system: LinearSystem, held: list[int], free: list[int], rows: Floats, constant: Floats
) -> None:
    """The structure's force on what is held, of held feet the pull; rows (|S|, n) of forces."""
    n = len(system.mass)
    if not held:
        return
    position, velocity = mode.to_physical[:n], mode.to_physical[n:]
    mode.outputs[held] = -product(rows, product(system.stiffness, position) + product(system.damping, velocity))
    mode.feed[held] = _force_feed(rows, system, free)
    onto = product(rows, system.normals[:, free])
    mode.feed_rate[np.ix_(held, free)] = onto
    mode.feed[np.ix_(held, free)] += product(mode.outputs[held], mode.beta[free].T)
    mode.bias.feed[:, held] = product(rows, constant).T
    moved = np.flatnonzero(mode.mobility)
    feet = [c for c in held if c < len(mode.beta)]
    mode.reaction[np.ix_(moved, feet)] = -product(rows[: len(feet)], system.normals[:, moved]).T


def _add_along(
    mode: ContactMode,
    system: LinearSystem,
    holding: list[int],
    free: list[int],
    rows: Floats,
    placed: Floats,
    force_in: Floats,
) -> None:
    """What feet do along the ground: those that slide or are in the air, and the places of those that stick."""
    n, m = system.normals.shape
    for i in range(m):
        way = system.constraints[:, m + i]
        if m + i in holding or not way.any():
            continue
        mode.slide_feed[holding, i] = product(rows, way)
        slide, rate = product(force_in, way), product(way, mode.to_physical[n:])
        if product(rate, slide) > REDUNDANT * product(way, system.per_impulse[:, m + i]):
            mode.slide[i], mode.slide_rate[i] = slide, rate  # else nothing moves it: other constraints hold it as well
        if i in free:
            continue
        mode.inputs[m + i], mode.outputs[m + i] = mode.slide[i], mode.slide_rate[i]
        mode.feed[holding, m + i] = mode.slide_feed[holding, i]
        mode.feed[m + i, free] = product(mode.beta[free], mode.slide_rate[i])
    for column, c in enumerate(holding):
        if c < m:
            continue
        x = mode.placed[c - m] = -placed[:, column]
        forces = -product(system.stiffness, x)
        mode.inputs[c] = product(force_in, forces)
        mode.feed[holding, c] += product(rows, forces)
        mode.feed[free, c] = product(x, system.normals[:, free])


def _add_stopped(
    mode: ContactMode,
    system: LinearSystem,
    i: int,
    held: list[int],
    springs: Floats,
    velocity: Floats,
    constant: Floats,
) -> None:
    """The pull on a free foot if it were stopped on the ground now."""
    together = sorted([*held, i])
    z, _, projector, rows = _holding(system, together)
    row = rows[together.index(i)]
    stopped = product(z, product(projector, velocity))
    mode.held[i] = -product(row, springs + product(system.damping, stopped))
    mode.held_feed[i] = _force_feed(row[None], system, [k for k in range(len(mode.beta)) if k not in together])[0]
    mode.bias.held_feed[:, i] = product(row, constant)


def _add_printed(mode: ContactMode, system: LinearSystem, i: int, restoring: Floats, constant: Floats) -> None:
    """-K x - C v of the foot's own coordinate as it is, and its terms K_pp x_p and C_pp x_p' with the other sign."""
    assert system.alone is not None
    row = system.alone[:, i]
    mode.printed[i] = -product(row, restoring)
    mode.printed_feed[i] = _force_feed(row[None], system, [])[0]
    mode.bias.printed_feed[:, i] = product(row, constant)
    mode.bias.printed_feed[i, i] -= 2.0 * (product(row, system.stiffness, row))
    mode.printed_damping[i] = product(row, system.damping, row)


def _leading(rows: Floats) -> tuple[NDArray[np.int64], Floats]:
    """Rows (k, n) of which all others are sums: their numbers (r,), and every row's shares of them (k, r).

    Of many feet on few modes only so many move by themselves. Each next one is that which the ones before leave most of, so
    that no share is large. What is below 1e-13 of the largest row is rounding.
    """
    if len(rows) == 1 and rows.any():
        return np.zeros(1, dtype=np.int64), np.eye(1)
    rest, size = rows.copy(), length(rows.T).max(initial=0.0)
    chosen: list[int] = []
    ways = np.zeros((0, rows.shape[1]))
    while len(chosen) < min(rows.shape):
        left = length(rest.T)
        best = int(np.argmax(left))
        if left[best] <= 1e-13 * size:
            break
        way = rest[best] - product(
            ways.T, product(ways, rest[best])
        )  # once more, for what rounding left of the others' ways
        ways = np.vstack([ways, way / length(way)])
        rest -= np.outer(product(rest, ways[-1]), ways[-1])
        chosen.append(best)
    chosen.sort()
    if len(chosen) == len(rows):
        return np.arange(len(rows)), np.eye(len(rows))
    shares = product(rows, pseudoinverse(rows[chosen])) if chosen else np.zeros((len(rows), 0))
    shares[chosen] = np.eye(len(chosen))
    return np.array(chosen, dtype=np.int64), shares


def _across(mass: Floats, normal: Floats, direction: Floats) -> tuple[Floats, float]:
    """What an impact direction d has across the normal: a velocity s with s^T M s = 1, n^T s = 0, and the factor skew.

    d = M^-1 n / mobility + skew s / sqrt(mobility), scaled so that n^T d = 1. A direction that the held feet leave no
    room for is taken mass-weighted (skew 0).
    """
    along = solve(mass, normal)
    mobility = product(normal, along)
    rate = product(normal, direction)
    size = np.sqrt(product(direction, mass, direction) * mobility)
    if rate <= 1e-9 * size:
        return np.zeros_like(normal), 0.0
    rest = direction / rate - along / mobility
    across = np.sqrt(product(rest, mass, rest))
    skew = across * np.sqrt(mobility)
    return (rest / across, skew) if skew > 1e-9 else (np.zeros_like(normal), 0.0)


def _force_feed(rows: Floats, system: LinearSystem, free: list[int]) -> Floats:
    """What rows (k, n) of forces have of the inputs directly: (k, ni)."""
    m, nd = system.normals.shape[1], system.loads.shape[1]
    out = np.zeros((len(rows), 2 * m + nd + 1), rows.dtype)
    out[:, 2 * m : -1] = product(rows, system.loads)
    out[:, [m + k for k in free]] = product(rows, system.normals[:, free])
    return out


class ModeBook:
    """Contact modes of a linear structure with their step tables, made when a run first meets them; safe between threads.

    lengths (nk,) [s] halve from entry to entry. rates: whether a law asks for gap rates at the nodes of a step.
    A pickle holds no tables.
    """

    def __init__(self, system: LinearSystem, lengths: Floats, rates: bool = True) -> None:
        self.system, self.lengths, self._rates = system, np.ascontiguousarray(lengths, dtype=float), rates
        self._modes: list[ContactMode] = []
        self._lock = Lock()
        self.native: Any = _native.Book(self.arrays, NODES, partial(unbiased_mode, system))
        """The modes and tables as the engine holds them."""

    def __reduce__(self) -> tuple[Any, ...]:
        return ModeBook, (self.system, self.lengths, self._rates)

    @property
    def arrays(self) -> dict[str, Any]:
        """The book as the engine takes it, by name."""
        system = self.system
        (n, m), given = system.normals.shape, system.tangents
        parts = {
            "normals": system.normals.T,
            "loads": system.loads.T,
            "damping": system.damping,
            "weight": system.weight,
            "tangents": np.zeros(0) if given is None else given.T,
        }
        sizes = {"feet": m, "drives": system.loads.shape[1], "coordinates": n, "rates": int(self._rates)}
        arrays = {name: np.ascontiguousarray(one, dtype=float) for name, one in parts.items()}
        return {"lengths": self.lengths, **sizes, **arrays}

    @property
    def modes(self) -> list[ContactMode]:
        """The contact modes in the order in which they were met."""
        with self._lock:  # each is added once, whoever asks first
            met = self.native.modes
            self._modes += [mode.biased(self.system.sources) for mode in met[len(self._modes) :]]
            return self._modes
