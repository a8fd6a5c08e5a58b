"""What is believed of the numbers of a device before a record: logarithms with a normal distribution."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.special import ndtri

from tarsus.base.arrays import Floats
from tarsus.base.errors import InputError
from tarsus.base.spec import Description, float_paths, get_value, with_values
from tarsus.fit.verdict import LEVEL
from tarsus.model.scene import Scene
from tarsus.model.structure import Walker
from tarsus.synthesis.devices import identified_paths
from tarsus.synthesis.walks import MOST_LEGS


@dataclass(frozen=True)
class Belief:
    """Numbers that are not known exactly, and how well they are.

    unknown: by name, as directions of their logarithms: each path moves by its value; covariance (np, np) of the
    logarithms.

    Raises InputError for numbers that are zero, and for what has no spread.
    """

    unknown: Mapping[str, Mapping[str, float]]
    covariance: Floats

    def __post_init__(self) -> None:
        problems = [
            f"{path}: a share of it is known, so that it needs a value other than 0"
            for one in self.unknown.values()
            for path, value in one.items()
            if value == 0.0
        ]
        problems += [
            f"{name}: a belief needs a spread above 0"
            for name, variance in zip(self.unknown, np.diag(self.covariance), strict=True)
            if not variance > 0.0
        ]
        if problems:
            raise InputError(problems)

    @classmethod
    def of(
        cls, scene: Scene, more: Sequence[str] = (), spread: float = 0.3, draws: Mapping[str, Floats] | None = None
    ) -> Belief:
        """What a scene says of the numbers that a campaign identifies, and of more at paths.

        Legs of a robot with many are believed alike: one number for those of all at once.

        Parameters
        ----------
        spread
            Standard deviation of the logarithm of what has neither draws nor an interval in its provenance.
        draws
            Draws (ns,) by path that belong together, such as those of an identification (`read_draws`): they bring
            their correlations.
        """
        unknown: dict[str, dict[str, float]] = {}
        for path in dict.fromkeys([*identified_paths(scene), *more]):
            value = float(get_value(scene, path))
            if value != 0.0 or path in more:
                unknown.setdefault(path if path in more else _together(scene, path), {})[path] = value
        wide = []
        for one in unknown.values():
            low, high = sorted(scene.interval(next(iter(one))) or (0.0, 0.0))
            known = low * high > 0.0 and bool(np.isfinite([low, high]).all())
            wide.append(abs(np.log(high / low)) / (2.0 * ndtri(0.5 + 0.5 * LEVEL)) if known else spread)
        covariance = np.diag(np.square(wide))
        drawn = {j: logs for j, name in enumerate(unknown) if (logs := _logs((draws or {}).get(name))) is not None}
        if drawn:
            at = list(drawn)
            covariance[np.ix_(at, at)] = np.cov(list(drawn.values()), ddof=1).reshape(len(at), -1)
        return cls(unknown, covariance)

    @property
    def std(self) -> Floats:
        """Standard deviations (np,) of the logarithms."""
        return np.sqrt(np.diag(self.covariance))

    def draws(self, count: int, seed: int = 0) -> Floats:
        """Logarithms (count, np) over those of the values: these themselves, then draws spread evenly (Sobol)."""
        from scipy.stats import qmc  # takes longer to load than a verb

        if count <= 1:
            return np.zeros((count, len(self.unknown)))
        # scipy before 1.15 knows no rng
        sobol = qmc.Sobol(len(self.unknown), seed=seed)  # pyright: ignore[reportCallIssue]
        drawn = qmc.MultivariateNormalQMC(np.zeros(len(self.unknown)), self.covariance, engine=sobol)
        # one by one: scipy warns of counts that are no power of 2
        return np.concatenate([np.zeros((1, len(self.unknown))), *(drawn.random(1) for _ in range(count - 1))])

    def scene(self, scene: Scene, logs: Floats) -> Scene:
        """The scene with numbers so far off, within what their descriptions allow."""
        moved = zip(self.unknown.values(), np.exp(logs).tolist(), strict=True)
        return with_values(
            scene,
            {
                path: float(np.clip(value * by, *field_limits(scene, path)))
                for one, by in moved
                for path, value in one.items()
            },
        )

    def directions(self, scene: Scene) -> dict[str, Mapping[str, float]]:
        """Directions of the logarithms at the values of a scene."""
        return {name: {path: float(get_value(scene, path)) for path in one} for name, one in self.unknown.items()}


def field_limits(scene: Scene, path: str) -> tuple[float, float]:
    """Smallest and largest value [SI] that the description of a float allows; infinite where it sets none.

    Raises
    ------
    InputError
        If the scene has no float at the path.
    """
    if path not in float_paths(scene):
        get_value(scene, path)  # an unknown path has a sentence of its own
        raise InputError(f"{path}: expected the path of a number")
    keys = path.split(".")
    while keys:
        name = keys.pop()
        owner = get_value(scene, ".".join(keys)) if keys else scene
        if isinstance(owner, Description):
            extra = type(owner).model_fields[name].json_schema_extra
            bounds = extra if isinstance(extra, dict) else {}
            low = bounds.get("ge", bounds.get("gt", -np.inf))
            high = bounds.get("le", bounds.get("lt", np.inf))
            return float(low), float(high)  # type: ignore[arg-type]
    raise InputError(f"{path}: expected the path of a number")


def _together(scene: Scene, path: str) -> str:
    """Name of a number: its path, or that of all legs together."""
    structure = scene.robot.structure
    parts = path.split(".")
    if parts[1:3] == ["structure", "legs"] and isinstance(structure, Walker) and len(structure.legs) > MOST_LEGS:
        parts[3] = "*"
    return ".".join(parts)


def _logs(draws: Floats | None) -> Floats | None:
    """Logarithms of draws that vary and are of one sign."""
    if draws is None or len(draws) <= 10 or float(np.ptp(draws)) <= 0.0 or not np.all(draws * draws[0] > 0.0):
        return None
    return np.log(np.abs(draws))
