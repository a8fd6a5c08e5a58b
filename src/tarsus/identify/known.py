"""What a chain knows at some point: parameters found so far, with draws, and the device with any values of them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tarsus.identify.foot import FootModel
from tarsus.identify.step import StepResult

__all__ = ["Known"]

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class Known:
    """Parameters found so far.

    base: the device as known beforehand; paths (p,); values (p,); samples (draws, p).
    """

    base: FootModel
    paths: tuple[str, ...]
    values: Floats
    samples: Floats

    def model(self, values: Floats | None = None) -> FootModel:
        """The device with the values found, or with others (p,)."""
        chosen = self.values if values is None else values
        return self.base.changed({path: float(v) for path, v in zip(self.paths, chosen, strict=True)})

    def after(self, step: StepResult) -> Known:
        """With what a further step found."""
        return Known(
            self.base,
            self.paths + step.paths,
            np.concatenate([self.values, step.values]),
            np.concatenate([self.samples, step.samples], axis=1),
        )
