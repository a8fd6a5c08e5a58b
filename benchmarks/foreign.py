"""How an identification stands up to campaigns of a laboratory that shares no code with the library.

Run ``python benchmarks/foreign.py FOLDER [--worlds NAME ...] [--devices N] [--first SEED] [--decibels DB] [--spread S]
[--make]``.
Campaigns are made in FOLDER once, with what is true of each beside them (truth.json), and read from there afterwards;
``--make`` only makes them. In every world of `independent.foreign.world.WORLDS` one thing differs from the library's
model; the first, "sound", differs in nothing.

For every campaign: each number's value, its truth, how many standard deviations apart they are, its verdict; what was
not done; the sentences that name the difference. At the end, by world: how many numbers are determined, how many of
those more than three standard deviations off, whether the cause is named. Exit code 1 where no number is determined, or
where more are that far off, or one farther off, than chance has it once in forty.
"""

from __future__ import annotations

import argparse
import json
import re
import sys
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.stats import binomtest, norm

from tarsus.base.errors import InputError
from tarsus.identify.assessment import assessed
from tarsus.identify.campaign import read_campaign
from tarsus.identify.chain import Identification, identify

sys.path.insert(0, str(Path(__file__).parents[1] / "tests"))
from independent.foreign.campaign import write_campaign
from independent.foreign.world import WORLDS, Device

FAR = 3.0
"""Standard deviations by which a number that is called determined may be off."""
BY_CHANCE = 0.0027
"""Share of a normal distribution beyond `FAR`."""
CHANCE = 0.025
"""Probability below which chance is no explanation."""
CAUSES = {
    "displacement 6 us late": r"\blate\b|delay",
    "displacement 20 us late": r"\blate\b|delay",
    "anti-alias filter": r"filter|bandwidth|low-pass",
    "film exponent 2": r"exponent",
    "cubic stiffness": r"cubic|stiffen|nonlinear spring",
    "creep of the drive": r"creep",
    "third mode": r"(third|further|another|more|missing|extra) modes?\b",
    "other thresholds": r"threshold",
    "rebounds until slow": r"landing rule.*(contradict|replaced|undecided|speed)|restitute",
    "restitution falls with speed": r"(restitution|\be\b).*speed",
    "gain of a channel": r"\bgain\b.*(channel|displacement)|(channel|displacement).*\bgain\b",
    "ground drifts": r"(ground|level|zero).*(drift|sink|different places|moves)",
    "compliant ground": r"complian|gives way|soft ground|stiffness of the ground",
    "mains hum": r"\bhum\b|mains|50 Hz",
    "clock 100 ppm off": r"clock",
    "lost fringes": r"fringe|drop-out|spike",
    "coupled displacement": r"high-pass|coupl",
    "coloured noise": r"coloured",
    "trigger jitter": r"trigger",
    "gains warm up": r"\bgains?\b",
    "slow amplifier": r"amplifier|\blate\b",
    "no poling between": r"poling|poled|history|different places",
    "drag of the air": r"\bdrag\b",
    "contacts scatter": r"scatter",
    "creep, and late": r"creep",
    "third mode, and restitution falls": r"further mode",
    "adhesion drifts": r"adhesion.*(order of recording|repeats of a record)",
    "restitution drifts": r"restitution.*(order of recording|speed)",
    "adhesion that ages": r"adhesion.*(age|saturat|grows no more|not linear|levels off|contact time)",
    "samples lost on the way": r"samples of the motion were lost",
}
"""Words by which a sentence names the difference; it must not be one that the sound world's campaign has as well. Of
others the cause stays unknown."""


@dataclass(frozen=True)
class Number:
    """One number of a campaign, SI: its value, truth, standard deviation and verdict."""

    path: str
    value: float
    true: float
    std: float
    verdict: str

    @property
    def off(self) -> float:
        """Standard deviations from the truth."""
        return abs(self.value - self.true) / self.std if self.std > 0.0 else np.inf

    @property
    def wrong(self) -> bool:
        """Whether it is called determined and is not."""
        return self.verdict == "determined" and not self.off <= FAR


@dataclass(frozen=True)
class Outcome:
    """What an identification made of a campaign: numbers; sentences; steps not done; seconds of CPU."""

    numbers: tuple[Number, ...]
    sentences: tuple[str, ...]
    not_done: tuple[str, ...]
    seconds: float


def truth_of(device: Device, world: str) -> dict[str, float]:
    """What is true by path, SI; without what has no meaning in that world."""
    drive = "robot.drives.pzt"
    out = {f"robot.structure.frequencies.{k}": v for k, v in enumerate(device.frequencies)}
    out |= {f"robot.structure.damping_ratios.{k}": v for k, v in enumerate(device.damping)}
    out |= {f"{drive}.load.participation.1": device.participation[1]}
    for name, value in zip(("constant", "linear", "quadratic", "cubic"), device.law, strict=True):
        out[f"{drive}.law.{name}"] = value
    differs = WORLDS[world]
    if not differs.thresholds:
        out |= {f"{drive}.law.weights.{k}": v for k, v in enumerate(device.weights)}
    if differs.exponent == 3:
        out["ground.film.coefficient"] = device.film[0]
    out |= {"ground.film.thickness": device.film[1], "ground.restitution.coefficient": device.restitution}
    return out | dict(zip(("ground.adhesion.initial", "ground.adhesion.rate"), device.adhesion, strict=True))


def made(folder: Path, world: str, seed: int, decibels: float, spread: float) -> Path:
    """The folder of a campaign, simulated and recorded if it is not there yet."""
    device = Device() if spread == 0.0 else Device().drawn(spread, seed)
    name = f"{world.replace(' ', '-')}-{seed}-{decibels:g}dB" + (f"-{spread:g}" if spread else "")
    where = folder / name
    if not (where / "truth.json").exists():
        write_campaign(where, device, WORLDS[world], seed, decibels=decibels, name=name)
        told = dict(world=world, seed=seed, decibels=decibels, truth=truth_of(device, world))
        (where / "truth.json").write_text(json.dumps(told, indent=1) + "\n")
    return where


def scored(folder: Path) -> Outcome:
    """Identify a campaign and compare it with its truth."""
    true = json.loads((folder / "truth.json").read_text())["truth"]
    start = time.process_time()
    try:
        found = identify(read_campaign(folder))
    except InputError as error:
        return Outcome((), tuple(error.problems), ("everything",), time.process_time() - start)
    seconds = time.process_time() - start
    judged = assessed(found)
    numbers = []
    for step in found.steps.values():
        for path, value, std in zip(step.paths, step.values.tolist(), step.std.tolist(), strict=True):
            if path not in true:
                continue
            word = judged[path].word if judged is not None and path in judged.names else ""
            numbers.append(Number(path, value, true[path], std, "" if path in step.taken else word))
    return Outcome(tuple(numbers), tuple(_sentences(found)), tuple(one.name for one in found.not_done), seconds)


def _sentences(found: Identification) -> list[str]:
    """All that an identification says, but for the list of data left out."""
    out = list(found.remarks) + [said for step in found.steps.values() for said in step.notes]
    out += [f"{one.name} was not done: {said}" for one in found.not_done for said in one.reasons]
    return out + ([] if found.landing is None else list(found.landing.sentences()))


def naming(world: str, outcome: Outcome, sound: Outcome | None) -> list[str]:
    """Sentences that name what differs in a world, and that a sound one does not have (numbers apart)."""
    usual = set() if sound is None else {_bare(said) for said in sound.sentences}
    words = re.compile(CAUSES.get(world, r"(?!)"), re.IGNORECASE)
    return [said for said in outcome.sentences if words.search(said) and _bare(said) not in usual]


def _bare(said: str) -> str:
    return re.sub(r"[-+]?[\d.]+(e[-+]?\d+)?", "#", said)


def report(world: str, name: str, outcome: Outcome, sound: Outcome | None) -> str:
    """One campaign of a world as text."""
    lines = [f"{world} ({name}): {outcome.seconds:.1f} s of CPU"]
    for one in outcome.numbers:
        flag = " <-- WRONG" if one.wrong else ""
        lines.append(
            f"  {one.path:38s} {one.value:12.5g} {one.true:12.5g} {100 * _relative(one):+8.2f} % {one.off:7.1f} sd  "
            f"{one.verdict}{flag}"
        )
    lines += [f"  not done: {name}" for name in outcome.not_done]
    named = naming(world, outcome, sound)
    lines += [f"  {'NAMED' if said in named else '  -  '}: {said}" for said in outcome.sentences]
    return "\n".join(lines)


def _relative(one: Number) -> float:
    return one.value / one.true - 1.0 if one.true else np.nan


def summary(outcomes: dict[str, list[Outcome]], sound: Outcome | None) -> str:
    """By world: determined, wrong, undone, named."""
    lines = [f"{'world':32s} {'numbers':>7s} {'determined':>10s} {'wrong':>6s} {'not done':>8s} {'named':>7s}  CPU"]
    for world, those in outcomes.items():
        numbers = [one for outcome in those for one in outcome.numbers]
        sure = [one for one in numbers if one.verdict == "determined"]
        named = sum(bool(naming(world, outcome, sound)) for outcome in those)
        undone = sum(len(outcome.not_done) for outcome in those)
        wrong = sum(one.wrong for one in sure)
        lines.append(
            f"{world:32s} {len(numbers):7d} {len(sure):10d} {wrong:6d} {undone:8d} {named:3d}/{len(those):<3d}"
            f"  {np.mean([outcome.seconds for outcome in those]):.1f} s"
        )
    return "\n".join(lines)


def together(outcomes: Sequence[Outcome]) -> tuple[str, bool]:
    """All campaigns in a line, and whether determined numbers are off as often and as far as chance has it."""
    sure = [one for outcome in outcomes for one in outcome.numbers if one.verdict == "determined"]
    wrong, worst = sum(one.wrong for one in sure), max((one.off for one in sure), default=np.inf)
    said = f"{wrong} of {len(sure)} determined numbers of {len(outcomes)} campaigns are wrong, {worst:.1f} sd at most"
    few = bool(sure) and binomtest(wrong, len(sure), BY_CHANCE, "greater").pvalue >= CHANCE
    return said, few and 2.0 * norm.sf(worst) * len(sure) >= CHANCE


def main(arguments: list[str]) -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path, help="of the campaigns")
    parser.add_argument("--worlds", nargs="+", default=list(WORLDS), choices=list(WORLDS), metavar="NAME")
    parser.add_argument("--devices", type=int, default=1, help="campaigns of each world")
    parser.add_argument("--first", type=int, default=1, help="seed of the first of them")
    parser.add_argument("--decibels", type=float, default=40.0, help="noise below each channel's motion")
    parser.add_argument("--spread", type=float, default=0.0, help="of drawn devices; 0 is the one of the paper")
    parser.add_argument("--make", action="store_true", help="only make the campaigns")
    options = parser.parse_args(arguments)
    outcomes: dict[str, list[Outcome]] = {}
    sound: Outcome | None = None
    for world in options.worlds:
        for seed in range(options.first, options.first + options.devices):
            where = made(options.folder, world, seed, options.decibels, options.spread)
            if options.make:
                continue
            outcome = scored(where)
            sound = outcome if world == "sound" and sound is None else sound
            outcomes.setdefault(world, []).append(outcome)
            print(report(world, where.name, outcome, sound), flush=True)
    if not outcomes:
        return 0
    print(summary(outcomes, sound))
    said, right = together([one for those in outcomes.values() for one in those])
    print(said)
    return int(not right)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
