"""What a chain knows at some point: parameters found so far, with draws, and the device with any values of them."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from tarsus.base.arrays import Floats
from tarsus.identify.draws import DRAWS
from tarsus.identify.foot import FootModel
from tarsus.identify.step import StepResult

PLACEHOLDER = "Placeholder, to be identified."
"""Origin of a number of a device that a campaign is to find."""

_LEAST = 1e-3
"""Part of what was found below which a draw of a positive constant does not fall: a device with zero is none."""


def possible(path: str, found: float) -> tuple[float, float]:
    """Ends between which a number of which this value was found is that of a device."""
    low = max(_LEAST * found, 0.0) if path.startswith(("ground.", "robot.structure.")) else -np.inf
    return low, 1.0 if path.startswith("ground.restitution.") else np.inf


@dataclass(frozen=True)
class Estimates:
    """Parameters found so far.

    base: the device as known beforehand; paths (p,); values (p,); samples (draws, p).
    """

    base: FootModel
    paths: tuple[str, ...]
    values: Floats
    samples: Floats

    def model(self, values: Floats | None = None) -> FootModel:
        """The device with the values found, or with others (p,).

        What an uncertain number may be on the way stays a device: constants of ground and structure do not fall below a
        thousandth of what was found, and the restitution does not exceed one.
        """
        chosen = self.values if values is None else values
        changes: dict[str, object] = {}
        for path, value, found in zip(self.paths, chosen.tolist(), self.values.tolist(), strict=True):
            low, high = possible(path, found)
            changes[path] = min(max(value, low), high)
        return self.base.changed(changes)

    @classmethod
    def nothing(cls, base: FootModel) -> Estimates:
        """Of a device of which nothing was found."""
        return cls(base, (), np.zeros(0), np.zeros((DRAWS, 0)))

    def certain(self) -> Estimates:
        """The same as if everything found were certain: no draw moves it."""
        return replace(self, samples=np.repeat(self.values[None], DRAWS, axis=0))

    def without(self, step: StepResult) -> Estimates:
        """Without what a step found."""
        kept = [i for i, path in enumerate(self.paths) if path not in step.paths]
        paths = tuple(self.paths[i] for i in kept)
        return replace(self, paths=paths, values=self.values[kept], samples=self.samples[:, kept])

    def updated(self, step: StepResult) -> StepResult:
        """A step with the values and draws that its numbers have by now: what later steps say moves them as well."""
        own = [self.paths.index(path) for path in step.paths]
        return replace(step, values=self.values[own], samples=self.samples[:, own])

    def redrawn(self, step: StepResult) -> Estimates:
        """With other draws of what a step found."""
        samples = self.samples.copy()
        samples[:, [self.paths.index(path) for path in step.paths]] = step.samples
        return replace(self, samples=samples)

    def after(self, step: StepResult) -> Estimates:
        """With what a further step found."""
        return Estimates(
            self.base,
            self.paths + step.paths,
            np.concatenate([self.values, step.values]),
            np.concatenate([self.samples, step.samples], axis=1),
        )
