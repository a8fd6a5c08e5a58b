"""Thousands of random scenes: are derivatives of events those of differences of higher order of tight runs at other
steps, to ten times the error that they state themselves, or flagged where there are none?

    python tests/survey_gradients.py FILE --count 10000 --workers 2

writes a line a scene, of modal robots and of walkers in turn, to FILE, goes on where it was stopped, and says what was
found.
"""

from __future__ import annotations

import os
import sys
from typing import Any

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import numpy as np
from numpy.typing import NDArray

import tarsus as ts
from random_scenes import plain_scene
from survey import arguments, part_of_a_survey, survey
from tarsus.base.spec import float_paths, get_value
from tarsus.plan.slots import slots

Floats = NDArray[np.float64]

TIGHT = ts.Accuracy(gap=1e-12, drive=1e-12)
FIELDS = ("time", "speed_before", "speed_after", "pull")
WITHIN = 10.0
"""Largest error of a derivative, in errors that it states itself."""
KNOWN = 2e-8
"""A difference counts where it is known that well."""
FLOOR = 3e-5
"""What would change the largest number of its kind by less than this, were the number of the scene twice as large, is
nothing: a part of 1e-7 of it is the rounding of a run, and of the derivatives of lowered arrays."""
ROUNDING = 1e-12
"""Part of a number that tight runs scatter by, their tolerance, at least; motion that is sensitive scatters more, which
the differences over the smallest steps tell. Differences that agree better than that allows do so by chance."""
SLOW = 1e-4
"""Impacts slower than this part of the hardest are not compared: they end an accumulation and multiply what a run
errs by."""
STEPS = 2e-3 / 2.0 ** np.arange(7)
"""Steps of differences, parts of the number: from where motion is hardly bent to where rounding is felt."""
MOVED = 0.1
"""Part of the largest of its kind that a number of an event changes by at most where motion is hardly bent."""
PATHS = 3
LATEST = 300
"""Events compared: after more the motion is so sensitive that differences of runs are no derivatives."""


def chosen(scene: ts.Scene, seed: int) -> list[str]:
    """Some of the numbers of a scene that runs can differ in, and one of its structure."""
    known = list(slots(scene))
    rng = np.random.default_rng([seed, 7])
    found = [known[k] for k in sorted(rng.permutation(len(known))[:PATHS])]
    of_structure = [path for path in float_paths(scene) if path.startswith("robot.structure.")]
    alone = [path for path in of_structure if changes_alone(scene, path)]
    return found + [alone[k] for k in rng.permutation(len(alone))[:1]]


def changes_alone(scene: ts.Scene, path: str) -> bool:
    """Whether a structure may differ in that number alone, which an entry of a symmetric matrix may not."""
    matrix, *place = path.removeprefix("robot.structure.").split(".")
    ratios = getattr(scene.robot.structure, "damping_ratios", None) is not None
    symmetric = matrix == "mass" or (matrix == "stiffness" and ratios)
    return not symmetric or place[0] == place[-1]


def scale_of_zero(scene: ts.Scene, path: str) -> float:
    """Of a number that is zero: the largest power of ten that moves no event by a part of ``MOVED``."""
    before = ts.simulate(scene, accuracy=TIGHT).events
    for power in range(0, -31, -1):
        try:
            after = ts.simulate(ts.with_values(scene, {path: 10.0**power}), accuracy=TIGHT).events
        except ts.InputError:
            continue
        if common([before, after]) == len(before) and all(
            np.abs(after[name][: len(before)] - before[name])[:LATEST].max(initial=0.0)
            <= MOVED * np.abs(before[name]).max(initial=0.0)
            for name in FIELDS
        ):
            return 10.0**power
    return 10.0**-30


def differences(scene: ts.Scene, path: str) -> tuple[Floats, Floats]:
    """Derivatives (fields, events) by a number of what events tell, and their errors: of the table of Richardson's
    extrapolations of central differences, that one each which differs least from its neighbours.

    Events go as far as all runs have the same ones; where the larger steps lose some, those are left out as long as
    three steps remain.
    """
    at = float(get_value(scene, path))
    sizes = STEPS * (abs(at) or scale_of_zero(scene, path))
    batch = ts.simulate_batch(
        scene, {path: np.concatenate([at + sizes, at - sizes])}, accuracy=TIGHT, threads=1, track=False
    )
    events = [batch.events(i) for i in range(2 * len(sizes))]
    best: tuple[Floats, Floats] = np.zeros((len(FIELDS), 0)), np.zeros((len(FIELDS), 0))
    for first in range(len(sizes) - 2):
        used = [*events[first : len(sizes)], *events[len(sizes) + first :]]
        count = common(used)
        if count <= best[0].shape[1]:
            continue
        n = len(sizes) - first
        table = np.array([[one[name][:count] for name in FIELDS] for one in used])
        width = 2.0 * sizes[first:, None, None]
        scatter = ROUNDING * np.abs(table).max(axis=0) / width
        slopes = (table[:n] - table[n:]) / width
        rough, _ = extrapolated(slopes, scatter)
        noise = (np.abs(slopes - rough) * width)[-3:].max(axis=0)
        found, error = extrapolated(slopes, np.maximum(scatter, noise / width))
        kept = best[0].shape[1]
        best = (np.concatenate([best[0], found[:, kept:]], axis=1), np.concatenate([best[1], error[:, kept:]], axis=1))
    return best


def common(events: list[NDArray[np.void]]) -> int:
    """How many of their first events all runs have alike."""
    count = min(len(one) for one in events)
    alike = np.ones(count, dtype=bool)
    for one in events[1:]:
        for name in ("foot", "kind"):
            alike &= one[name][:count] == events[0][name][:count]
    return count if alike.all() else int(np.argmin(alike))


def extrapolated(first: Floats, scatter: Floats) -> tuple[Floats, Floats]:
    """Richardson's extrapolation of differences (steps, ...) that scatter, each step half the one before, and its
    error."""
    best, error = first[0].copy(), np.full(first.shape[1:], np.inf)
    column, order = first, 1
    while len(column) > 1:
        after = column[1:] + (column[1:] - column[:-1]) / (4.0**order - 1.0)
        for k in range(len(after)):
            own = np.maximum(np.abs(after[k] - column[k + 1]), np.abs(after[k] - column[k])) + scatter[k + order]
            better = own < error
            best[better], error[better] = after[k][better], own[better]
        column, order = after, order + 1
    return best, error


def look_at(scene: ts.Scene, seed: int, paths: list[str] | None = None) -> dict[str, Any]:
    """What became of a scene: how many numbers of events were compared, how many are off by more than they may, the
    largest error relative to the largest of its kind, wrong ones, signs, flags; by these numbers, else by some."""
    paths, refused = paths or chosen(scene, seed), []
    while True:
        try:
            run = ts.simulate(scene, gradients=paths)
            break
        except ts.InputError as error:  # what cannot vary by itself, which its sentence begins with
            refused += [said.split(":")[0] for said in error.problems]
            paths = [path for path in paths if path not in refused]
    assert isinstance(run, ts.solve.GradientRun)
    out: dict[str, Any] = {"code": run.code.name, "events": len(run.events), "worst": 0.0, "compared": 0, "beyond": 0}
    out |= {
        "wrong": [],
        "signs": 0,
        "flagged": [path for path in paths if path in run.flags],
        "paths": paths,
        "refused": refused,
    }
    speed = run.events["speed_before"]
    slow = (speed > 0.0) & (speed < SLOW * speed.max(initial=0.0))
    for path in paths:
        try:
            wanted, error = differences(scene, path)
        except ts.InputError:  # at an end of its range there are differences to one side alone
            continue
        got, stated = run.event_gradients[path], run.event_errors[path]
        count = min(wanted.shape[1], len(got), LATEST)
        for name, want, own in zip(FIELDS, wanted[:, :count], error[:, :count], strict=True):
            had = got[name][:count]
            largest = run.end_time if name == "time" else np.abs(run.events[name]).max(initial=1e-300)
            least = FLOOR * largest / (abs(float(get_value(scene, path))) or 1.0)
            size = np.maximum.accumulate(np.maximum(np.abs(want), least))
            known = np.isfinite(had) & (own <= KNOWN * size) & ~slow[:count]
            off = np.where(known, np.abs(had - want), 0.0)
            out["compared"] += int(known.sum())
            out["worst"] = max(out["worst"], float((off / size).max(initial=0.0)))
            wrong = np.flatnonzero(off > WITHIN * stated[name][:count] + own + KNOWN * size)
            out["beyond"] += len(wrong)
            out["signs"] += int((known & (had * want < 0.0) & (np.abs(want) > 1e-5 * size)).sum())
            if len(wrong):
                k = int(wrong[0])
                out["wrong"].append([path, name, k, float(had[k]), float(want[k]), float(stated[name][k])])
    return out


def of_both(seed: int) -> dict[str, Any]:
    """The same of modal robots, even seeds, and of walkers."""
    return look_at(plain_scene(seed // 2, legged=bool(seed % 2)), seed // 2)


def main() -> int:
    part_of_a_survey(of_both)
    given = arguments(__doc__).parse_args()
    found = survey(__file__, given.file, given.count, given.workers)
    ran = {seed: one for seed, one in found.items() if "compared" in one}
    wrong = {seed: one for seed, one in ran.items() if one["wrong"]}
    for seed, one in list(wrong.items())[:20]:
        print(seed, one["code"], one["wrong"][0])
    for seed, one in found.items():
        if "error" in one:
            print(seed, one["error"])
    asked = sum(len(one["paths"]) for one in ran.values())
    flagged = sum(len(one["flagged"]) for one in ran.values())
    refused = sum(len(one["refused"]) for one in ran.values())
    print(
        f"{len(found)} scenes, {len(ran)} compared in {sum(one['compared'] for one in ran.values())} numbers, "
        f"{sum(one['beyond'] for one in ran.values())} off by more than ten times their own error; "
        f"{len(wrong)} scenes with a wrong one, {sum(one['signs'] for one in ran.values())} wrong signs; "
        f"{flagged} of {asked} derivatives flagged, {refused} refused"
    )
    return 0 if not wrong else 1


if __name__ == "__main__":
    sys.exit(main())
