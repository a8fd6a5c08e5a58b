"""A random, self-affine ground."""

import math
from collections.abc import Sequence
from functools import lru_cache
from typing import Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from tarsus.base.spec import Amount, MaybeAmount, quantity
from tarsus.model.profile.base import Floats, Profile

Complex = NDArray[np.complex128]


class RandomGround(Profile):
    """Heights at equal distances with the spectrum of a self-affine surface, for ever.

    A wave of number q = 2 pi j / (facets spacing), j = 1 ... facets / 2, has a random phase and the power
    (1 + (q correlation_length)^2)^-(hurst + 1/2); all together have the RMS height ``rms`` exactly. With ``growth``
    heights are 1 + growth x times as large, and the ground ends with its facets.

    With ``across`` it is a surface that is alike in all directions, each foot on the line at its own place: waves of
    lines a distance d apart are as alike as those of the surface whose power goes by
    (1 + (q correlation_length)^2)^-(hurst + 1), of which that above is what one line sees. Each line has the RMS
    height. The line in the middle is that of the same seed without.
    """

    kind: Literal["random"] = "random"
    seed: Amount = quantity(
        "1", "of the phases: another whole part is another ground of the same kind", ge=0, le=2.0**53
    )
    rms: Amount = quantity("m", "RMS height", ge=0)
    correlation_length: Amount = quantity("m", "length above which heights know nothing of one another", gt=0)
    hurst: Amount = quantity("1", "Hurst exponent: the lower, the rougher", default=0.8, gt=0, le=1)
    spacing: Amount = quantity("m", "distance between neighbouring points", gt=0)
    facets: int = Field(default=512, ge=4, le=1_000_000, description="how many until the ground repeats itself")
    growth: MaybeAmount = quantity(
        "1/m", "by which heights grow along the way, of those at its begin; absent: they do not", default=None
    )

    across: bool = Field(
        default=False, description="whether the ground varies across the way too, or feet have one line"
    )

    def points(self) -> Floats:
        return self._line(self._waves(1)[0])

    def side_by_side(self, places: Sequence[float]) -> list[Floats]:
        own = self._waves(1 + len(places))
        shares = _shares(tuple(places), self.correlation_length, self.hurst, self.spacing, self.facets)
        return [self._line(np.sum(part * own, axis=0)) for part in shares]

    def _waves(self, count: int) -> Complex:
        """Independent waves (count, nw) of size 1."""
        rng = np.random.default_rng(int(self.seed))
        return np.exp(1j * rng.uniform(0.0, 2.0 * math.pi, (count, self.facets // 2)))

    def _line(self, waves: Complex) -> Floats:
        """The points of a line with waves (nw,) of the mean size 1."""
        number = _numbers(self.facets, self.spacing)
        size = (1.0 + (number * self.correlation_length) ** 2) ** (-0.5 * (self.hurst + 0.5))
        z = np.fft.irfft(np.concatenate([[0.0], size * waves]), self.facets)
        z *= self.rms / math.sqrt(float(np.mean(z**2)))
        x = self.spacing * np.arange(self.facets + 1)
        heights = np.append(z, z[0]) * (1.0 + (self.growth or 0.0) * x)
        return np.array([x, heights], dtype=float).T.copy()

    @property
    def wide(self) -> bool:
        return self.across

    @property
    def repeats(self) -> bool:
        return self.growth is None


def _numbers(facets: int, spacing: float) -> Floats:
    """Wave numbers [1/m] of heights that repeat after so many facets."""
    return np.asarray(2.0 * math.pi * np.arange(1, facets // 2 + 1) / (facets * spacing), dtype=np.float64)


@lru_cache(maxsize=8)
def _shares(places: tuple[float, ...], correlation_length: float, hurst: float, spacing: float, facets: int) -> Floats:
    """Shares (k, k + 1, nw) of independent waves in those of lines at places [m] across the way, the first of them the
    wave of the middle: Cholesky factors of how alike lines are."""
    number = _numbers(facets, spacing)
    rate = np.sqrt(number**2 + correlation_length**-2.0)
    at = (0.0, *places)
    factor = np.zeros((len(at), len(at), len(number)))
    for i, there in enumerate(at):
        for j, here in enumerate(at[: i + 1]):
            alike = _coherence(abs(there - here) * rate, hurst + 0.5)
            rest = alike - np.sum(factor[i, :j] * factor[j, :j], axis=0)
            if i == j:
                factor[i, i] = np.sqrt(np.maximum(rest, 0.0))
            else:
                # of a line that is another one already, nothing is left to share
                factor[i, j] = np.divide(rest, factor[j, j], out=np.zeros_like(rest), where=factor[j, j] > 1e-7)
    return factor[1:]


def _coherence(distance: Floats, order: float) -> Floats:
    """How alike waves of lines are, 2^(1 - n) / Gamma(n) x^n K_n(x) of distances x (nw,) between them, of order n:
    the integral of s^(n - 1) exp(-s - x^2 / 4 s) over s > 0 for that without x, by the logarithm of s, of which the
    integrand and all its derivatives vanish at both ends, so that equal steps are exact to rounding."""
    log = np.arange(-80.0, 6.0, 0.1)
    weight = np.exp(order * log - np.exp(log))
    near = np.exp(-0.25 * np.multiply.outer(distance**2, np.exp(-log)))
    return np.asarray(np.sum(near * weight, axis=-1) / np.sum(weight), dtype=np.float64)
