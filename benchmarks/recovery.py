"""How well numbers are recovered from records made by the library's own synthesis, and whether their intervals hold.

Run ``python benchmarks/recovery.py FILE [--kind campaign] [--devices N] [--first SEED] [--rate HZ] [--decibels DB]``.
Every trial appends one line of JSON to FILE; trials that are there already are not repeated, so that a run can be
stopped and goes on, and FILE holds many settings. Without ``--devices`` only what FILE holds is printed: by setting and
number how often the 95 % interval covers the truth, with the interval of that share, of all numbers that have an
interval and of those called determined. Exit code 1 where a trial gave no numbers, where none was determined, or where
fewer intervals of determined ones hold the truth than chance has it once in forty.

``campaign``: a device, all numbers that a campaign identifies drawn within 20 % of the device's, its campaign in a
temporary folder, identified. ``impacts``: a drive (square or sine, its frequency), a gap and a restitution, the printed
hexapod near the ground and in the air, both with a vibrometer at 200 kHz whose trigger is late by up to a sample; its
impact map.
"""

from __future__ import annotations

import argparse
import json
import sys
import tempfile
import time
from collections import defaultdict
from collections.abc import Callable, Iterable
from dataclasses import asdict, dataclass, field
from pathlib import Path

import numpy as np
from scipy.stats import binomtest

import tarsus as ts
from tarsus.base.errors import InputError
from tarsus.base.spec import float_paths
from tarsus.files.library import load_scene
from tarsus.identify.assessment import assessed
from tarsus.identify.campaign import read_campaign
from tarsus.identify.chain import Identification, identify
from tarsus.impacts.impact_map import estimate_impact_map
from tarsus.synthesis.campaign_folder import write_campaign
from tarsus.synthesis.devices import perturbed
from tarsus.synthesis.recordings import Instrument
from tarsus.synthesis.vibrometer import Vibrometer

SPREAD = 0.2
"""Part of itself by which a number of a device is drawn about the packaged one."""
DETERMINED = "determined"
FAR = 3.0
"""Standard deviations from which on a number is listed as an offender."""


@dataclass(frozen=True)
class Setting:
    """What is recorded how: kind of trial; device; samples per second; noise below the motion [dB]."""

    kind: str = "campaign"
    device: str = "cantilever-capture"
    rate: float = 20e3
    decibels: float = 40.0

    def __str__(self) -> str:
        return f"{self.kind}, {self.device}, {1e-3 * self.rate:g} kHz, {self.decibels:g} dB"


@dataclass(frozen=True)
class Number:
    """One number [SI]: estimate, truth, standard deviation, ends of its interval (NaN without one), verdict."""

    value: float
    true: float
    std: float
    low: float
    high: float
    verdict: str = DETERMINED

    @property
    def covered(self) -> bool:
        """Whether the interval holds the truth."""
        return self.low <= self.true <= self.high

    @property
    def off(self) -> float:
        """Standard deviations from the truth, with sign."""
        return (self.value - self.true) / self.std if self.std > 0.0 else np.inf

    @property
    def relative(self) -> float:
        """Error over the truth; absolute where that is zero."""
        return self.value / self.true - 1.0 if self.true else self.value


@dataclass
class Trial:
    """What one seed gave: numbers by name; steps that were not done; CPU seconds of the identification."""

    seed: int
    numbers: dict[str, Number] = field(default_factory=dict)
    not_done: list[str] = field(default_factory=list)
    seconds: float = 0.0


def campaign_trial(setting: Setting, seed: int) -> Trial:
    """One device: drawn, recorded, identified."""
    truth = perturbed(load_scene(setting.device), SPREAD, seed)
    out = Trial(seed)
    with tempfile.TemporaryDirectory() as folder:
        try:
            instrument = Instrument(rate=setting.rate, snr_db=setting.decibels)
            write_campaign(truth, Path(folder), instrument, seed)
            start = time.process_time()
            found = identify(read_campaign(folder))
        except InputError as error:
            out.not_done = [f"everything: {error}"]
            return out
    out.seconds = time.process_time() - start
    out.not_done = [f"{one.name}: {'; '.join(one.reasons)}" for one in found.not_done]
    true = {path: one.value for path, one in float_paths(truth).items()}
    out.numbers = identified(found, true)
    return out


def identified(found: Identification, true: dict[str, float]) -> dict[str, Number]:
    """Numbers of an identification against their truth, and of the film what impacts and flights tell best."""
    judged = assessed(found)
    out: dict[str, Number] = {}
    for step in found.steps.values():
        for path, value, std in zip(step.paths, step.values.tolist(), step.std.tolist(), strict=True):
            word = judged[path].word if judged is not None and path in judged.names else ""
            low, high = step.interval(path)
            out[path] = Number(value, true[path], std, low, high, "" if path in step.taken else word)
    name = "C / g0^3"
    if "film" in found.steps and name in found.steps["film"].combinations:
        value, draws, _ = found.steps["film"].combinations[name]
        low, high = np.quantile(draws, [0.025, 0.975]).tolist()
        cubed = true["ground.film.coefficient"] / true["ground.film.thickness"] ** 3
        word = out["ground.film.coefficient"].verdict
        out[name] = Number(float(value), cubed, float(np.std(draws)), low, high, word)
    return out


def impact_trial(setting: Setting, seed: int) -> Trial:
    """One drive, gap and restitution: simulated, recorded near the ground and in the air, estimated."""
    sys.path.insert(0, str(Path(__file__).parents[1] / "tests"))
    from printed_robots import POINTS, hexapod, printed

    random = np.random.default_rng(seed)
    square = bool(random.integers(2))
    wave, hz = (ts.Square, random.uniform(15.0, 60.0)) if square else (ts.Sine, random.uniform(60.0, 140.0))
    restitution = float(random.uniform(0.3, 0.7))
    signal = wave(amplitude=10.0, frequency=hz)
    near = hexapod(signal=signal, gap=float(random.uniform(8e-6, 12e-6)), restitution=restitution)
    far = ts.with_values(near, {"robot.feet.foot1.gap": 0.03})
    close, in_air = (ts.simulate(scene, 0.12) for scene in (near, far))
    vibrometer = Vibrometer(rate=setting.rate, jitter=1.0 / setting.rate)
    vibrometer = vibrometer.at_level(close, POINTS, setting.decibels)
    records = [vibrometer.measure(run, POINTS, 2 * seed + i) for i, run in enumerate((close, in_air))]
    start = time.process_time()
    try:
        found = estimate_impact_map(*records, near.robot.structure, "foot1")
    except InputError as error:
        return Trial(seed, {}, [f"everything: {error}"])
    mobility = np.linalg.inv(printed()[0])[:, 0]
    true = {"restitution": restitution}
    true |= {f"jump of {name}": v for name, v in zip(POINTS, mobility / mobility[0], strict=True)}
    spreads = {"restitution": found.restitution}
    spreads |= {f"jump of {n}": s for n, s in zip(found.names, found.column, strict=True) if n != found.foot}
    numbers = {n: Number(s.value, float(true[n]), s.std, s.low, s.high) for n, s in spreads.items()}
    return Trial(seed, numbers, [], time.process_time() - start)


KINDS: dict[str, Callable[[Setting, int], Trial]] = {"campaign": campaign_trial, "impacts": impact_trial}


def saved(file: Path) -> dict[Setting, dict[int, Trial]]:
    """Trials that a file holds, by setting and seed."""
    out: dict[Setting, dict[int, Trial]] = defaultdict(dict)
    for line in file.read_text().splitlines() if file.exists() else []:
        row = json.loads(line)
        setting = Setting(**row.pop("setting"))
        numbers = {name: Number(**one) for name, one in row.pop("numbers").items()}
        out[setting][row["seed"]] = Trial(numbers=numbers, **row)
    return out


def run(file: Path, setting: Setting, seeds: Iterable[int]) -> None:
    """Add the trials that a file does not hold yet, one after the other."""
    known = saved(file).get(setting, {})
    for seed in seeds:
        if seed in known:
            continue
        trial = KINDS[setting.kind](setting, seed)
        with file.open("a") as lines:
            lines.write(json.dumps({"setting": asdict(setting)} | asdict(trial)) + "\n")
        print(f"{setting}: seed {seed}, {trial.seconds:.1f} s", file=sys.stderr, flush=True)


def held(numbers: list[Number]) -> str:
    """How many intervals hold the truth, and the 95 % interval of that share."""
    if not numbers:
        return f"{'-':>24s}"
    low, high = share_held(numbers)
    share = f"{sum(one.covered for one in numbers)} of {len(numbers)}"
    return f"{share:>12s} {100 * low:3.0f} - {100 * high:3.0f} %"


def share_held(numbers: list[Number]) -> tuple[float, float]:
    """The 95 % interval of the share of intervals that hold the truth (Clopper and Pearson, 1934)."""
    ends = binomtest(sum(one.covered for one in numbers), len(numbers)).proportion_ci(0.95)
    return float(ends.low), float(ends.high)


def sound(trials: list[Trial]) -> bool:
    """Whether every trial gave numbers, and intervals of those determined hold the truth as often as they say."""
    sure = [one for trial in trials for one in trial.numbers.values() if one.verdict == DETERMINED]
    return all(trial.numbers for trial in trials) and bool(sure) and share_held(sure)[1] >= 0.95


def report(setting: Setting, trials: list[Trial]) -> str:
    """The figures of one setting as text; deviations are those of numbers with an interval, by its own spread."""
    by_name: dict[str, list[Number]] = defaultdict(list)
    for trial in trials:
        for name, one in trial.numbers.items():
            by_name[name].append(one)
    lines = [
        f"{setting}: {len(trials)} devices",
        f"{'number':42s} {'with interval, covered':>24s} {'determined, covered':>24s} {'mean |error|':>12s} "
        f"{'worst':>9s} {'median sd':>9s} {'rms off':>8s} {'mean off':>8s}",
    ]
    for name, numbers in by_name.items():
        told = [one for one in numbers if np.isfinite([one.low, one.high]).all()]
        sure = [one for one in told if one.verdict == DETERMINED]
        size = np.abs([one.relative for one in told or numbers])
        off = np.array([one.off for one in told if np.isfinite(one.off)])
        spread = [one.std / abs(one.true) if one.true else one.std for one in told or numbers]
        lines.append(
            f"{name:42s} {held(told):>24s} {held(sure):>24s} {size.mean():12.3g} {size.max():9.3g} "
            f"{np.median(spread):9.3g} {_rms(off):8.2f} {off.mean() if len(off) else np.nan:+8.2f}"
        )
    every = [one for those in by_name.values() for one in those]
    sure = [one for one in every if one.verdict == DETERMINED]
    lines.append(f"all: {held([one for one in every if np.isfinite(one.low)])}; determined: {held(sure)}")
    seconds = np.array([one.seconds for one in trials if one.seconds > 0.0])
    if len(seconds):
        lines.append(f"CPU: median {np.median(seconds):.1f} s, {seconds.max():.1f} s at most")
    return "\n".join([*lines, *_offenders(trials)])


def _rms(values: np.ndarray) -> float:
    return float(np.sqrt(np.mean(values**2))) if len(values) else np.nan


def _offenders(trials: list[Trial]) -> list[str]:
    """Determined numbers far from their truth, the farthest first, and steps that were not done."""
    far = [
        (abs(one.off), f"seed {trial.seed}: {name} {one.relative:+.3g}, {one.off:+.1f} standard deviations")
        for trial in trials
        for name, one in trial.numbers.items()
        if one.verdict == DETERMINED and not abs(one.off) <= FAR
    ]
    undone = [f"seed {trial.seed}: {said}" for trial in trials for said in trial.not_done]
    return [said for _, said in sorted(far, reverse=True)] + undone


def main(arguments: list[str]) -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("file", type=Path, help="of the trials, JSON lines")
    parser.add_argument("--kind", choices=list(KINDS), default="campaign")
    parser.add_argument("--device", help="packaged device that campaigns are drawn about")
    parser.add_argument("--devices", type=int, default=0, help="how many, from the first seed on")
    parser.add_argument("--first", type=int, default=1, help="seed of the first")
    parser.add_argument("--rate", type=float, help="samples per second")
    parser.add_argument("--decibels", type=float, default=40.0, help="noise below the motion")
    options = parser.parse_args(arguments)
    usual = Setting() if options.kind == "campaign" else Setting("impacts", "printed hexapod", 200e3)
    setting = Setting(usual.kind, options.device or usual.device, options.rate or usual.rate, options.decibels)
    run(options.file, setting, range(options.first, options.first + options.devices))
    settings = saved(options.file)
    for one, trials in settings.items():
        print(report(one, [trials[seed] for seed in sorted(trials)]), end="\n\n")
    return int(not all(sound(list(trials.values())) for trials in settings.values()))


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
