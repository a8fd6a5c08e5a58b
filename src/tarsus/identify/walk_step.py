"""The walks of a campaign as a step of its identification: ground and legs of a walker, with draws."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from tarsus.base.arrays import Floats
from tarsus.base.errors import InputError
from tarsus.base.quantities import Quantity
from tarsus.base.spec import float_paths, with_values
from tarsus.fit.verdict import Verdict
from tarsus.identify.campaign import RecordSet
from tarsus.identify.draws import DRAWS, NORMAL
from tarsus.identify.step import Check, Panel, Residual, StepResult, Used, measured_and_fitted, over_noise
from tarsus.identify.walk_feet import odd_feet
from tarsus.identify.walk_prediction import prediction_check
from tarsus.identify.walking import ALL, JUMP, WalkFit, WalkRecord, identify_walk
from tarsus.model.scene import Scene
from tarsus.model.structure import Walker
from tarsus.records.measurement import Measurement
from tarsus.solve import Output
from tarsus.tables.numbers import amount

GROUND_KNOWN, LEGS_KNOWN = 1.0, 0.1
"""Standard deviations of logarithms beforehand: a number of the ground within a factor of seven, one of a leg as far as
drawings and a material's data tell it; a device's own intervals prevail."""
SAME = 1.3
"""Scatter of repeats over the noise of one up to which they show one motion, and are averaged."""
_GROUND = tuple(f"ground.{name}." for name in ("restitution", "friction", "film", "adhesion", "electrostatic"))
DIFFERING = ("ground.restitution.coefficient", "ground.friction.coefficient", "ground.adhesion.initial")
"""What may differ from foot to foot: what a foot's own surface changes most."""
_LEG = ("stiffness_v", "damping_v", "stiffness_l", "damping_l")
_SEEN = (
    Quantity.DISPLACEMENT,
    Quantity.VELOCITY,
    Quantity.ANGLE,
    Quantity.ANGULAR_VELOCITY,
    Quantity.ACCELERATION,
    Quantity.CHARGE,
    Quantity.CURRENT,
)


def unknowns_of(scene: Scene) -> dict[str, float]:
    """What walks may tell of a walker and its ground, with standard deviations of logarithms beforehand."""
    out: dict[str, float] = {}
    for path, one in float_paths(scene).items():
        ground = path.startswith(_GROUND)
        leg = path.startswith("robot.structure.legs.") and path.endswith(_LEG)
        if not (ground or leg) or not one.value > 0.0:
            continue
        known = scene.origin(path)
        ends = None if known is None or known.interval is None else known.interval
        out[path] = GROUND_KNOWN if ground else LEGS_KNOWN
        if ends is not None and len(ends) == 1 and 0.0 < ends[0][0] < ends[0][1]:
            out[path] = float(np.log(ends[0][1] / ends[0][0]) / (2.0 * NORMAL))
    return out


def noise_of(values: Floats) -> Floats:
    """Standard deviations (nc,) of samples from fourth differences of channels (nc, nt): what changes smoothly over
    five samples leaves nothing of them, and impacts are too few to move a median."""
    weights = np.array([1.0, -4.0, 6.0, -4.0, 1.0])
    fourth = np.array([np.convolve(row, weights, "valid") for row in values])
    spread = 1.4826 * np.median(np.abs(fourth), axis=1) / np.sqrt(weights @ weights)
    size = np.abs(values).max(axis=1, initial=0.0)
    rounding = 1e-9 * np.where(size > 0.0, size, 1.0)  # of what has no noise
    return np.asarray(np.maximum(spread, rounding), dtype=np.float64)


def walk_records(scene: Scene, name: str, one: RecordSet, records: Sequence[Measurement]) -> list[WalkRecord]:
    """Records of a set of walks; repeats that show one motion are averaged.

    Raises InputError for channels that a walker has not, and a set that does not say what its drives did.
    """
    if one.gait is None and not one.signals:
        raise InputError(f"{name}: its set states neither a gait nor signals, which say what the drives did")
    driven = with_values(scene, {"gait": one.gait, "signals": dict(one.signals)})
    out = [_walk_record(driven, name, one, record) for record in records]
    alike = len({(each.outputs, each.values.shape) for each in out}) == 1
    if len(out) < 2 or not alike:
        return out
    values = np.array([each.values for each in out])
    values = values - (values - values.mean(axis=0)).mean(axis=2, keepdims=True) * _zeroed(out[0])[:, None]
    scatter = np.sqrt(values.var(axis=0, ddof=1).mean(axis=1))
    if np.any(scatter > SAME * np.median([each.noise for each in out], axis=0)):
        return out
    noise = scatter / np.sqrt(len(out))
    return [replace(out[0], values=values.mean(axis=0), noise=noise, name=name, estimated=False)]


def _zeroed(record: WalkRecord) -> Floats:
    """1 for channels with a zero of their own, else 0."""
    return np.isin(np.arange(len(record.outputs)), record.shifted).astype(float)


def _walk_record(scene: Scene, name: str, one: RecordSet, record: Measurement) -> WalkRecord:
    channels = [c for c in record.channels if c.quantity in _SEEN]
    if not channels:
        raise InputError(f"{record.source}: no channel shows a motion, a charge or a current")
    motional = {Quantity.CHARGE, Quantity.CURRENT} if one.bridge else set()
    outputs = tuple(Output(c.quantity, c.at, c.quantity in motional) for c in channels)
    values = record.select([c.name for c in channels]).values
    noise = noise_of(values)
    given = np.array([np.nan if c.noise is None else c.noise for c in channels])
    times = np.asarray(np.arange(record.count) * record.step - one.rest, dtype=np.float64)
    after = times > 0.0
    return WalkRecord(
        scene,
        times[after],
        outputs,
        values[:, after],
        np.where(given > 0.0, given, noise),
        name=record.source or name,
        estimated=not bool(np.all(given > 0.0)),
        set=name,
    )


def identify_walking(
    scene: Scene, records: Sequence[WalkRecord], seed: int, by_foot: bool = False, left_out: Sequence[WalkRecord] = ()
) -> StepResult:
    """Ground and legs of a walker from its walks. That the ground differs from foot to foot is tried; where it does,
    numbers of feet are combinations of the step; by_foot: whether it is known to; left_out: walks that are predicted.

    Raises
    ------
    InputError
        For a robot that is no walker, and without records.
    """
    if not isinstance(scene.robot.structure, Walker):
        raise InputError("walks are identified of walkers: the structure is of another kind")
    unknowns, units = unknowns_of(scene), float_paths(scene)
    fit = identify_walk(records, unknowns, differing=[path for path in unknowns if path in DIFFERING], differ=by_foot)
    verdicts = {path: fit.verdict(path) for path in fit.paths}
    draws = np.random.default_rng([seed, 23]).standard_normal((DRAWS, len(fit.paths)))
    samples = fit.values * np.exp(draws @ np.linalg.cholesky(fit.covariance).T)
    samples = np.where(
        [path.startswith("ground.restitution.") for path in fit.paths], np.minimum(samples, 1.0), samples
    )
    share = Check(
        "share of samples that are not followed",
        1.0 - fit.followed,
        1.0 - ALL,
        paths=fit.paths,
        cause="walks move otherwise than the model between some contacts",
    )
    jump = Check(
        "largest jump of a start from the end of the window before, over what a model may miss",
        fit.jump,
        JUMP,
        paths=fit.paths,
        cause="the ground is rougher, or feet hang lower or higher, than the scene says",
    )
    uneven = [
        Check(
            f"what {path} would gain if it differed from foot to foot, over chance",
            gain,
            1.0,
            cause=_under(path, fit, units[path].unit),
        )
        for path, gain in fit.asked.items()
    ]
    predicted = (prediction_check(fit.paths, samples, left_out),) if left_out else ()
    contacts = f"{len(fit.good)} windows between contacts, {1e3 * _median_length(fit):.3g} ms at the median"
    own = np.random.default_rng([seed, 29]).standard_normal((len(fit.feet), DRAWS))
    feet = {
        name: (value, value * np.exp(sd * drawn), units[name.partition(": ")[2]].unit)
        for (name, (value, sd)), drawn in zip(fit.feet.items(), own, strict=True)
    }
    spreads = [f"{path} differs by {100 * apart:.2g} % from foot to foot" for path, apart in fit.apart.items()]
    seen = [(r, off) for r, off in zip(records, fit.residuals, strict=True)]
    return StepResult(
        "walking",
        fit.paths,
        fit.values,
        samples,
        taken=tuple(path for path in fit.paths if verdicts[path] is Verdict.ASSUMED),
        residuals=tuple(_residual(r, off, k) for r, off in seen for k in range(len(r.outputs))),
        used=(Used("windows", int(fit.good.sum()), len(fit.good)),),
        checks=(share, jump, *uneven, *predicted),
        notes=(f"Found in {contacts}.", *(f"{said}." for said in spreads)),
        combinations=feet,
        panels=tuple(_panel(r, off) for r, off in seen[:2]),
        influence=fit.influence,
    )


def _under(path: str, fit: WalkFit, unit: str) -> str:
    """Under which foot the ground differs, and by what."""
    odd = " and ".join(f"foot {foot}" for foot in odd_feet(path, fit.feet))
    own = ", ".join(
        f"{amount(value, unit, 3)} under {name.partition(': ')[0]}"
        for name, (value, _) in fit.feet.items()
        if name.endswith(f": {path}")
    )
    return f"the ground differs under {odd}: {path} is {own}"


def _median_length(fit: WalkFit) -> float:
    return float(np.median(np.concatenate([np.diff(one) for one in fit.edges])))


def _residual(record: WalkRecord, off: Floats, channel: int) -> Residual:
    left = off[channel]
    return over_noise(f"{record.name}: {record.outputs[channel].name}", left[np.isfinite(left)])


def _panel(record: WalkRecord, off: Floats) -> Panel:
    """The channel that moves most over its noise, measured and fitted."""
    k = int(np.argmax(record.values.std(axis=1) / record.noise))
    seen = np.isfinite(off[k])
    left = -off[k][seen] * record.noise[k]
    one = record.outputs[k]
    axes = "time", "s", one.name, one.quantity.unit
    return measured_and_fitted(record.name, axes, record.times[seen], record.values[k][seen] - left, left)
