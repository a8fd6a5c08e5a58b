"""Robots as a workshop makes them: what is scattered about a drawing, on which grounds they walk, who is lame."""

from __future__ import annotations

import fnmatch
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from tarsus.base.arguments import Quantity, Range, Ranges
from tarsus.base.errors import InputError, InputProblem
from tarsus.base.messages import nearest
from tarsus.base.spec import FloatInfo, by_path, float_paths, get_value
from tarsus.base.units import format_quantity, parse_quantity
from tarsus.model.scene import Scene
from tarsus.study.axes import Linspace, Normal, SweepAxis
from tarsus.study.manufacture import Saltelli, Scattered
from tarsus.study.sweep import Sweep

Scatter = Quantity
"""The standard deviation of a value: SI, a text with a unit, or a share of the scene's own value such as ``"5%"``."""

GAINS = "robot.drives.*.law.gain"
"""What a leg is dead by: the gain of its drive."""

MOST_SCATTER = 1.0
"""Standard deviation over the value beyond which a word is taken for a slip: one robot in six would have the value's
other sign."""


@dataclass(frozen=True)
class Robots:
    """A scene with what is scattered in its manufacture.

    scatter: axes of values by path; over: axes of grounds by path; legs: the leg of each path that a pattern with
    `*` named; parts: paths that are dead or weak in some; dead, weak: fewest and most; weakness: what is left of a
    weak one.
    """

    scene: Scene
    scatter: Mapping[str, SweepAxis]
    over: Mapping[str, SweepAxis]
    legs: Mapping[str, str]
    parts: tuple[str, ...] = ()
    dead: tuple[int, int] = (0, 0)
    weak: tuple[int, int] = (0, 0)
    weakness: float = 0.5

    @classmethod
    def of(
        cls,
        scene: Scene,
        scatter: Mapping[str, Scatter],
        over: Ranges | None = None,
        *,
        dead: tuple[int, int] = (0, 0),
        weak: tuple[int, int] = (0, 0),
        weakness: float = 0.5,
    ) -> Robots:
        """Robots of a drawing.

        Parameters
        ----------
        scene
            The robot of the drawing, on its ground.
        scatter
            By path, how its value scatters; `*` in a path stands for every leg, each of which is drawn by itself.
        over
            By path, both ends of a range that is drawn from evenly.
        dead, weak
            Fewest and most legs whose drive does nothing, or has only a share of its gain.
        weakness
            That share.

        Raises
        ------
        InputError
            With everything that is wrong in the scatter, and where nothing is scattered.
        """
        known, problems = float_paths(scene), []
        axes: dict[str, SweepAxis] = {}
        grounds: dict[str, SweepAxis] = {}
        legs: dict[str, str] = {}
        kinds: Any = ((axes, _scattered, scatter), (grounds, _evenly, over or {}))
        for made, axis_of, given in kinds:
            for pattern, value in by_path(scene, given).items():
                found = [path for path in known if fnmatch.fnmatchcase(path, pattern)]
                if not found:
                    problems.append(InputProblem.at(pattern, _no_number(scene, pattern, known)))
                for path in found:
                    try:
                        made[path] = axis_of(known[path], value)
                    except InputError as error:
                        problems += [InputProblem.at(pattern, one) for one in error.problems]
                        break
                    legs |= _leg(pattern, path)
        parts = ()
        if any((*dead, *weak)):
            parts = tuple(path for path in known if fnmatch.fnmatchcase(path, GAINS))
        for path in parts:
            axes.setdefault(path, Normal(mean=known[path].value, deviation=0.0))
            legs |= _leg(GAINS, path)
        if not axes and not grounds and not problems:
            text = "give the standard deviation of a value, a range of grounds, or dead legs"
            problems.append(f"nothing is scattered: {text}")
        if problems:
            raise InputError(problems)
        return cls(scene, axes, grounds, legs, parts, dead, weak, weakness)

    def sweep(self, count: int, measures: Sequence[str], *, seed: int = 0, **options: Any) -> Sweep:
        """Runs of so many robots, each on a ground of its own; options: others of a sweep."""
        design = Scattered(
            count=count, seed=seed, parts=self.parts, dead=self.dead, weak=self.weak, weakness=self.weakness
        )
        return self._sweep("robots", design, {**self.scatter, **self.over}, measures, options)

    def legs_sweep(self, count: int, measures: Sequence[str], *, seed: int = 0, **options: Any) -> Sweep | None:
        """Runs that determine whose scatter matters, no leg being dead; None where fewer than two vary; options: others
        of a sweep."""
        axes = {name: axis for name, axis in {**self.scatter, **self.over}.items() if np.ptp(axis.ends) > 0.0}
        groups = tuple(self.legs.get(name, name) for name in axes)
        if len(set(groups)) < 2:
            return None
        return self._sweep("legs", Saltelli(count=count, seed=seed, groups=groups), axes, measures, options)

    def _sweep(
        self, name: str, design: Any, axes: Mapping[str, SweepAxis], measures: Sequence[str], options: Mapping[str, Any]
    ) -> Sweep:
        own: Any = dict(axes)
        return Sweep(
            name=f"{self.scene.name}: {name}",
            scene=self.scene,
            vary=own,
            design=design,
            measures=tuple(measures),
            **options,
        )


def _scattered(about: FloatInfo, text: float | str) -> Normal:
    percent = isinstance(text, str) and text.endswith("%")
    size = parse_quantity(str(text)[:-1].strip(), "1") / 100.0 if percent else parse_quantity(text, about.unit)
    if size < 0.0:
        raise InputError(f"expected a standard deviation of 0 or more, got '{text}'")
    if percent:
        if about.value == 0.0:
            raise InputError(
                f"{text} of 0 is nothing: give the standard deviation as a value, such as '2 {about.unit}'"
            )
        return Normal(mean=about.value, deviation=abs(about.value) * size)
    if about.value != 0.0 and size > MOST_SCATTER * abs(about.value):
        plain = re.fullmatch(r"\d+(?:\.\d+)?", str(text))
        meant = f"{text}%" if plain and float(text) <= 100.0 else "10%"
        raise InputError(
            f"a standard deviation of {format_quantity(size, about.unit)} is {size / abs(about.value):.3g} "
            f"times the value itself, {format_quantity(about.value, about.unit)}; a share of it is given in percent, "
            f"such as '{meant}'"
        )
    return Normal(mean=about.value, deviation=size)


def _evenly(about: FloatInfo, ends: Range) -> Linspace:
    if isinstance(ends, str) or len(ends) != 2:
        raise InputError(f"expected both ends of a range, got {ends!r}")
    first, last = (parse_quantity(one, about.unit) for one in ends)
    if first > last:
        raise InputError(f"the range from {ends[0]} to {ends[1]} is empty")
    return Linspace(start=first, stop=last)


def _no_number(scene: Scene, pattern: str, known: Mapping[str, FloatInfo]) -> str:
    """Why a pattern stands for nothing that scatters."""
    try:
        unset = get_value(scene, pattern) is None
    except InputError:
        unset = False
    return (
        "is not set in this scene: set it first" if unset else f"is not a number in this scene{nearest(pattern, known)}"
    )


def _leg(pattern: str, path: str) -> dict[str, str]:
    """The leg of a path: what the first `*` of its pattern stands for."""
    if "*" not in pattern:
        return {}
    found = re.match(re.escape(pattern).replace(r"\*", "(.*?)") + "$", path)
    return {path: found.group(1)} if found else {}
