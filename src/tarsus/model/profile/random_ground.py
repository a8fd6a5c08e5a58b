"""A random, self-affine ground."""

import math
from typing import Literal

import numpy as np
from pydantic import Field

from tarsus.base.spec import Amount, MaybeAmount, quantity
from tarsus.model.profile.base import Floats, Profile


class RandomGround(Profile):
    """Heights at equal distances with the spectrum of a self-affine surface, for ever.

    A wave of number q = 2 pi j / (facets spacing), j = 1 ... facets / 2, has a random phase and the power
    (1 + (q correlation_length)^2)^-(hurst + 1/2); all together have the RMS height ``rms`` exactly. With ``growth``
    heights are 1 + growth x times as large, and the ground ends with its facets.
    """

    kind: Literal["random"] = "random"
    seed: Amount = quantity(
        "1", "of the phases: another whole part is another ground of the same kind", ge=0, le=2.0**53
    )
    rms: Amount = quantity("m", "RMS height", ge=0)
    correlation_length: Amount = quantity("m", "length above which heights know nothing of one another", gt=0)
    hurst: Amount = quantity("1", "Hurst exponent: the lower, the rougher", default=0.8, gt=0, le=1)
    spacing: Amount = quantity("m", "distance between neighbouring points", gt=0)
    facets: int = Field(
        default=512, ge=4, le=1_000_000, description="how many until the ground repeats itself"
    )
    growth: MaybeAmount = quantity(
        "1/m", "by which heights grow along the way, of those at its begin; absent: they do not", default=None
    )

    def points(self) -> Floats:
        waves = np.arange(1, self.facets // 2 + 1)
        number = 2.0 * math.pi * waves / (self.facets * self.spacing)
        size = (1.0 + (number * self.correlation_length) ** 2) ** (-0.5 * (self.hurst + 0.5))
        phase = np.random.default_rng(int(self.seed)).uniform(0.0, 2.0 * math.pi, len(waves))
        spectrum = np.concatenate([[0.0], size * np.exp(1j * phase)])
        z = np.fft.irfft(spectrum, self.facets)
        z *= self.rms / math.sqrt(float(np.mean(z**2)))
        x = self.spacing * np.arange(self.facets + 1)
        heights = np.append(z, z[0]) * (1.0 + (self.growth or 0.0) * x)
        return np.array([x, heights], dtype=float).T.copy()

    @property
    def repeats(self) -> bool:
        return self.growth is None
