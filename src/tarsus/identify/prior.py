"""What is known of parameters: logarithms with a normal distribution."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.stats import norm, qmc

from tarsus.base.errors import InputError
from tarsus.base.spec import float_paths, get_value
from tarsus.fit.verdict import LEVEL
from tarsus.model.scene import Scene

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class LogNormalPrior:
    """What is known of np positive parameters: logarithms with a normal distribution.

    paths; values (np,): medians, SI; covariance (np, np) of the logarithms.

    Raises
    ------
    InputError
        If the shapes do not fit, a value is not above zero, or a parameter has no spread.
    """

    paths: tuple[str, ...]
    values: Floats
    covariance: Floats

    def __post_init__(self) -> None:
        count = len(self.paths)
        if np.shape(self.values) != (count,) or np.shape(self.covariance) != (count, count):
            raise InputError(f"expected {count} values and a covariance of shape {(count, count)}")
        problems = [
            f"{path}: a prior in logarithms needs a value above 0, got {value:g}"
            for path, value in zip(self.paths, self.values, strict=True)
            if not value > 0.0
        ]
        problems += [
            f"{path}: a prior needs a spread above 0"
            for path, variance in zip(self.paths, np.diag(self.covariance), strict=True)
            if not variance > 0.0
        ]
        if problems:
            raise InputError(problems)

    @classmethod
    def of_samples(cls, paths: Sequence[str], samples: ArrayLike) -> LogNormalPrior:
        """From draws (ns, np), all positive: a bootstrap or a posterior."""
        rows = np.asarray(samples, dtype=float)
        rows = rows[np.isfinite(rows).all(axis=1)]
        if len(rows) <= len(paths) or not np.all(rows > 0.0):
            raise InputError(f"a prior needs more than {len(paths)} draws, all above 0")
        logs = np.log(rows)
        covariance = np.cov(logs, rowvar=False, ddof=1).reshape(len(paths), len(paths))
        return cls(tuple(paths), np.exp(np.median(logs, axis=0)), covariance)

    @classmethod
    def of_scene(
        cls,
        scene: Scene,
        paths: Sequence[str],
        spread: float = 0.3,
        draws: Mapping[str, Floats] | None = None,
    ) -> LogNormalPrior:
        """From a scene's values and what is known of them.

        Parameters
        ----------
        spread
            Standard deviation of the logarithm of what has neither draws nor an interval in its provenance.
        draws
            Draws (ns,) by path that belong together, such as those of an identification (`read_draws`): they bring
            their correlations. Those of numbers that are zero or less in some draws are left out.
        """
        values = np.array([float(get_value(scene, path)) for path in paths])
        wide = []
        for path in paths:
            low, high = scene.interval(path) or (0.0, 0.0)
            known = 0.0 < low < high < np.inf
            wide.append(np.log(high / low) / (2.0 * norm.ppf(0.5 + 0.5 * LEVEL)) if known else spread)
        covariance = np.diag(np.square(wide))
        drawn = [j for j, path in enumerate(paths) if _usable((draws or {}).get(path))]
        if drawn and draws is not None:
            logs = np.log(np.column_stack([draws[paths[j]] for j in drawn]))
            covariance[np.ix_(drawn, drawn)] = np.cov(logs, rowvar=False, ddof=1).reshape(len(drawn), -1)
        return cls(tuple(paths), values, covariance)

    @property
    def std(self) -> Floats:
        """Standard deviations (np,) of the logarithms."""
        return np.sqrt(np.diag(self.covariance))

    def draws(self, count: int, seed: int = 0) -> Floats:
        """Draws (count, np) of the logarithms about those of the values, spread evenly (Sobol)."""
        # scipy before 1.15 knows no rng
        sobol = qmc.Sobol(len(self.paths), seed=seed)  # pyright: ignore[reportCallIssue]
        engine = qmc.MultivariateNormalQMC(np.zeros(len(self.paths)), self.covariance, engine=sobol)
        # the first point by itself: scipy warns of counts that are no power of 2
        return np.concatenate([engine.random(1), engine.random(count - 1)]) if count > 1 else engine.random(1)


def unknown_paths(scene: Scene, more: Sequence[str] = ()) -> tuple[str, ...]:
    """Paths of what is not known exactly: every positive number of the laws of the ground, and ``more``.

    Gravity and the direction of impacts are known.
    """
    own = [
        path
        for path, info in float_paths(scene).items()
        if path.startswith("ground.") and not path.startswith(_KNOWN) and info.value > 0.0
    ]
    return tuple(dict.fromkeys([*own, *more]))


def _usable(draws: Floats | None) -> bool:
    """Whether draws have logarithms that vary."""
    return draws is not None and len(draws) > 10 and bool(np.all(draws > 0.0)) and float(np.ptp(draws)) > 0.0


_KNOWN = ("ground.gravity.", "ground.impact.")
