"""What every target is given: a scene, the library's own run of it, and what its drives exert."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from tarsus.base.events import IMPACTS, EventKind
from tarsus.model.drive.pieces import Pieces, evaluate
from tarsus.model.scene import Scene
from tarsus.plan.lowering import Plan, level_only, still_only
from tarsus.solve import Run, simulate

Floats = NDArray[np.float64]

LOW = 1e-2
"""A flight below this part of the highest is none: in other tools, whose contacts are springs, resting feet tremble."""

INNER = 24
"""Points inside a piece of a drive that is not constant: straight lines between them deviate by 1e-3 of its bend."""


@dataclass(frozen=True)
class Subject:
    """A scene and its own run."""

    scene: Scene
    run: Run

    @classmethod
    def of(cls, scene: Scene, duration: float) -> Subject:
        """Simulated over a duration [s]."""
        still_only(scene, "other tools put robots")
        run = simulate(scene, duration)
        level_only(run.plan, "other tools put robots")
        return cls(scene, run)

    @property
    def plan(self) -> Plan:
        """The scene as arrays."""
        return self.run.plan

    @property
    def feet(self) -> tuple[str, ...]:
        """Names of the feet."""
        return tuple(self.scene.robot.feet)

    @property
    def drives(self) -> tuple[str, ...]:
        """Names of the drives."""
        return tuple(self.scene.robot.drives)

    def law(self, hook: str, *arguments: float) -> float:
        """What the law on one hook gives (`tarsus.model.laws.Law.hook`), 0 where none acts there; arguments that are
        not given are 0."""
        law = next(iter(self.scene.ground.acting_on(hook).values()), None)
        return 0.0 if law is None else float(law.evaluate(*arguments, *(0.0 for _ in law.leading[len(arguments) :])))

    @cached_property
    def touchdowns(self) -> NDArray[np.void]:
        """Impacts of the run, in order of time."""
        return self.run.events[np.isin(self.run.events["kind"], IMPACTS)]

    @cached_property
    def impact_speed(self) -> float:
        """Approach speed of hard impacts [m/s], that of nine tenths of all after flights; without any, that of a fall
        through the height of flights in a period of the fastest mode."""
        found = self.touchdowns["speed_before"][self._flew]
        return float(np.quantile(found, 0.9)) if len(found) else self.height * self.plan.rate

    @cached_property
    def height(self) -> float:
        """Height of flights [m], that of nine tenths of them, else the widest gap at rest."""
        found = self.touchdowns["apex"][self._flew]
        gaps = [foot.gap for foot in self.scene.robot.feet.values()]
        return float(np.quantile(found, 0.9)) if len(found) else max([*gaps, 0.0]) or self.plan.length

    @property
    def _flew(self) -> NDArray[np.bool_]:
        """Which touchdowns (nc,) follow a flight that was none of the last bounces of a series."""
        apex = self.touchdowns["apex"]
        return apex > LOW * apex.max(initial=0.0)

    @cached_property
    def held_strength(self) -> float:
        """Strength [N] of contacts when they end, the median over the run; without a release that at no age."""
        ends = self.run.events[self.run.events["kind"] == EventKind.RELEASE]["strength"]
        return float(np.median(ends)) if len(ends) else self.law("strength", 0.0)

    def forces(self, times: Floats) -> Floats:
        """Force (nd, nt) [N] of every drive at times [s], behind its amplifier, its law and its history; on a jump the
        value after it."""
        own = self.plan.channels[: len(self.drives)]
        return np.array([evaluate(one, times) for one in own]).reshape(len(own), len(times))

    def drive_table(self, duration: float) -> tuple[Floats, Floats]:
        """Times (nt,) [s] and forces (nt, nd) [N] with straight lines between them; a jump is two rows of one time."""
        times = knots(self.plan.channels[: len(self.drives)], duration, inner=INNER)
        before = np.where(times > 0.0, np.nextafter(times, 0.0) - 1e-15 * times, 0.0)
        values = np.stack([self.forces(before).T, self.forces(times).T], axis=1)
        moments = np.repeat(times, 2)
        rows = values.reshape(2 * len(times), -1)
        size = np.abs(rows).max(initial=0.0)
        jumps = (
            np.abs(values[:, 1] - values[:, 0]).max(axis=1, initial=0.0) > 1e-9 * size
        )  # of a force of rounding none
        kept = np.stack([jumps, np.ones_like(jumps)], axis=1).ravel()
        return moments[kept], rows[kept]


def expanded(pieces: Pieces, duration: float) -> Pieces:
    """The same channel with its repeating pieces written out up to a duration [s], and what is held as a piece."""
    start, coef = [pieces.start[:-1]], [pieces.coef]
    end = float(pieces.start[-1])
    if pieces.loop >= 0:
        first = float(pieces.start[pieces.loop])
        span, one = end - first, pieces.start[pieces.loop : -1]
        for turn in range(1, 1 + max(int(np.ceil((duration - end) / span)), 0)):
            start.append(one + turn * span)
            coef.append(pieces.coef[pieces.loop :])
            end = first + (turn + 1) * span
    elif end < duration:
        held = np.zeros((1, pieces.coef.shape[1]))
        held[0, 0] = pieces.coef[-1].sum()
        start.append(np.array([end]))
        coef.append(held)
        end = duration
    starts, rows = np.concatenate(start), np.concatenate(coef)
    count = max(int(np.searchsorted(starts, duration)), 1)
    ends = np.append(starts, max(end, duration))[: count + 1]
    return Pieces(ends, rows[:count], np.ones(count, dtype=bool), -1)


def knots(channels: Sequence[Pieces], duration: float, inner: int = 0) -> Floats:
    """Moments [s] from 0 to a duration at which pieces of channels begin, with so many inside those that bend."""
    found = [np.array([0.0, duration])]
    for one in channels:
        whole = expanded(one, duration)
        bends = np.any(whole.coef[:, 2:] != 0.0, axis=1)
        shares = np.arange(1, inner + 1) / (inner + 1.0)
        inside = whole.start[:-1, None] + np.diff(whole.start)[:, None] * shares
        found += [whole.start, inside[bends].ravel()]
    times = np.unique(np.concatenate(found))
    return times[times <= duration]
