"""Problems with a plain function as their forward model, and a study of a bouncing ball."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from tarsus.calibrate.description import Search
from tarsus.calibrate.lowering import lower_study
from tarsus.calibrate.objective import Cells, Hypothesis, Objective, SoftLimit
from tarsus.calibrate.problem import CalibrationProblem
from tarsus.calibrate.studyfile import load_study
from tarsus.fit import Prior, Unknowns

SCENES = Path(__file__).parents[1] / "scenes"


def search(**values: Any) -> Search:
    """A short search."""
    short = {
        "population": 12,
        "prescreening": 32,
        "short": 4,
        "generations": 12,
        "spread": 12,
        "leave_out": False,
        "members": 16,
    }
    return Search(**{**short, **values})


def unknowns(names: str, low: float = 0.0, high: float = 1.0, priors: tuple[Prior | None, ...] = ()) -> Unknowns:
    """Numbers between two bounds, one a letter of ``names``."""
    count = len(names)
    return Unknowns(
        tuple(names),
        ("1",) * count,
        np.full(count, low),
        np.full(count, high),
        np.zeros(count, dtype=bool),
        priors or (None,) * count,
    )


def cells(observed: Any, absolute: float = 0.01, relative: float = 0.0, exists: bool = False) -> Cells:
    """A table (nr, nk) with one tolerance for all."""
    table = np.asarray(observed, dtype=float)
    count = table.shape[1]
    return Cells(
        tuple(f"y{k}" for k in range(count)),
        ("1",) * count,
        table,
        np.full(table.shape, absolute),
        np.full(count, relative),
        np.ones(count),
        np.full(count, exists),
    )


def problem(
    table: Cells,
    function: Any,
    numbers: Unknowns,
    hypotheses: tuple[Hypothesis, ...] | None = None,
    limits: tuple[SoftLimit, ...] = (),
    robust: float = 3.0,
    extra_rows: int = 0,
) -> CalibrationProblem:
    """A problem whose readings are ``function(run, set) -> (rows, channels, samples)``."""
    if hypotheses is None:
        hypotheses = (Hypothesis({}, 0, tuple(range(len(table.names)))),)

    def simulate(run: int, sets: np.ndarray, rows: Any) -> np.ndarray:
        return np.array([np.asarray(function(run, one), dtype=float)[list(rows)] for one in sets])

    count = len(table.observed)
    every = tuple(range(count + extra_rows))
    return CalibrationProblem(numbers, hypotheses, simulate, Objective(table, limits, robust), every)


BALL = """
device = "SCENES/ball.toml"
table = "table.csv"
conditions = ["drop"]
measures = {
    "rate": {"unit": "1/s", "measure": "bounces_per_second", "counts": True, "existence": True},
    "height": {"unit": "cm", "measure": "peak", "relative": 0.02, "absolute": "1 mm"},
}
unknowns = {
    "e": {"low": 0.5, "high": 0.95, "paths": ["ground.restitution.coefficient"]},
    "push": {"low": 0.0, "high": 1.5},
}
choices = {"height": {"options": {"highest": {"height": "peak"}, "average": {"height": "mean_height"}}}}
sampling = {"settle": "1 s", "window": "2 s", "windows": 1}
search = {"population": 6, "prescreening": 12, "short": 2, "generations": GENERATIONS, "spread": 3,
          "leave_out": LEAVE_OUT, "members": 6}


def changes(unknowns, row):
    return {"robot.feet.ball.gap": f"{row['drop']} cm", "initial.velocity": [2 * unknowns.push]}
"""


def ball_study(folder: Path, rows: str, text: str = BALL, *, generations: int = 5, leave_out: bool = False) -> Path:
    """A study of a pushed ball's rebounds in a folder; rows: lines of its table."""
    (folder / "table.csv").write_text("drop,rate,height\n" + rows, encoding="utf-8")
    file = folder / "ball.py"
    for word, value in (("SCENES", SCENES), ("GENERATIONS", generations), ("LEAVE_OUT", leave_out)):
        text = text.replace(word, str(value))
    file.write_text(text, encoding="utf-8")
    return file


def true_rows(folder: Path, truth: dict[str, float], drops: Sequence[int] = (50, 80, 120), text: str = BALL) -> str:
    """Rows of the table that a ball of the true numbers gives: `height` is its mean height."""
    lowered = lower_study(load_study(ball_study(folder, "".join(f"{d},1,1\n" for d in drops), text)))
    values = np.array([[truth[name] for name in lowered.problem.unknowns.names]])
    found = lowered.forward(0, values, range(len(drops)))[0, :, :, 0]
    rate, height = (lowered.forward.channels.index(name) for name in ("bounces_per_second", "mean_height"))
    return "".join(
        f"{drop},{line[rate]:.6g},{100.0 * line[height]:.6g}\n" for drop, line in zip(drops, found, strict=True)
    )


def bent_rows(seed: int, misfit: float = 0.2, unknown: int = 9, rows: int = 12) -> tuple[CalibrationProblem, Any]:
    """A problem of 9 unknowns and 12 x 3 cells that no set fits: the truth times a chance factor of ``misfit``.

    Also its forward model, sets (ns, 9) of the unit cube to readings (ns, 12, 3).
    """
    rng = np.random.default_rng(seed)
    slopes = rng.normal(0.0, 1.0, (rows * 3, unknown))
    bends = rng.normal(0.0, 0.8, (rows * 3, unknown, unknown))

    def model(cube: np.ndarray) -> np.ndarray:
        u = cube - 0.5
        return np.exp(u @ slopes.T + np.einsum("ni,kij,nj->nk", u, bends, u)).reshape(-1, rows, 3)

    observed = model(rng.random((1, unknown)))[0] * np.exp(rng.normal(0.0, misfit, (rows, 3)))
    names = tuple(f"y{k}" for k in range(3))
    table = Cells(
        names, ("1",) * 3, observed, np.zeros(observed.shape), np.full(3, 0.1), np.ones(3), np.zeros(3, dtype=bool)
    )

    def simulate(run: int, sets: np.ndarray, chosen: Any) -> np.ndarray:
        return model(sets)[:, list(chosen), :, None]

    numbers = unknowns("abcdefghi"[:unknown])
    one = CalibrationProblem(numbers, (Hypothesis({}, 0, (0, 1, 2)),), simulate, Objective(table), tuple(range(rows)))
    return one, model
