"""Tables of README.md and of pages of docs from what the verbs wrote: no number in them is typed.

    python docs/figures.py                              # write the tables into the pages
    python docs/figures.py --check                      # 1 where a page, or a packaged mixture, says something else
    python docs/figures.py take cantilever fit          # keep what the tables need of a new result; then write

`take NAME FILE-OR-FOLDER` reads the JSON that the command of `COMMANDS` leaves there and keeps the part that the tables
need in `docs/results/NAME.json`. In a page a table stands between `<!-- figures: NAME -->` and `<!-- end -->`.
"""

from __future__ import annotations

import argparse
import hashlib
import json
import re
import sys
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

ROOT = Path(__file__).parents[1]
RESULTS = Path(__file__).with_name("results")
OF_DOCS = ("agreement", "validation")
PAGES = (ROOT / "README.md", *(ROOT / "docs" / f"{name}.md" for name in OF_DOCS))

COMMANDS = {
    "cantilever": ("tarsus calibrate cantilever -o fit", "calibration.json"),
    "hexapod": ("tarsus calibrate hexapod -o fit", "calibration.json"),
    "millipede": ("tarsus reproduce millipede -o out", "reproduction.json"),
    "validation": ("tarsus validate --all -o pages", "validation.json"),
    "speed": (
        "python benchmarks/run.py --sizes 2 6 32 --peers heyoka --members 1024 --repeats 3 --json speed.json",
        "speed.json",
    ),
}
"""Result -> the command that writes it, and in which file."""

Table = Mapping[str, Any]


# What is kept of a result


def kept_calibration(found: Table, folder: Path) -> dict[str, Any]:
    """Errors, choices and branches of a calibration, without rows and correlations."""
    branches = [
        {key: value for key, value in one.items() if key not in ("correlations", "constraints", "found")}
        for one in found["branches"]
    ]
    files = {f"{name}_sha256": folder / file for name, file in (("study", "study.py"), ("table", "table.csv"))}
    return {
        **{key: found[key] for key in ("tarsus", "study", "seed", "sets", "summary", "choices")},
        **{key: hashlib.sha256(file.read_bytes()).hexdigest() for key, file in files.items()},
        "branches": branches,
    }


def kept_millipede(found: Table, folder: Path) -> dict[str, Any]:
    """Scores of the devices, and of the packaged random readings."""
    from tarsus_reproduce.interpretations import SEED, distribution, packaged_interpretations

    counts = ("agrees", "contradicts", "insensitive", "not determined")
    names = ("agree", "contradict", "insensitive", "not_determined")
    variants: dict[str, dict[str, Any]] = {}
    for row in found["Score over 16 trends"][:-1]:
        right, total = map(int, row["directional trends that agree"].split(" of "))
        numbers = dict(zip(names, (row[name] for name in counts), strict=True))
        own = variants.setdefault(row["device"], {})
        own[row["measured over"]] = numbers | {"directional_agree": right, "directional_total": total}
    scores = packaged_interpretations()
    return {"variants": variants, "readings": {"judged": len(scores), "seed": SEED, **distribution(scores)}}


def kept_validation(found: Table, folder: Path) -> dict[str, Any]:
    """Claims of every experiment, without rows."""
    keys = ("name", "rows", "median_error", "bias", "seen", "after_run", "outcome")
    return {
        "numbers": found["numbers"],
        "experiments": {
            name: {
                "title": one["title"],
                "fitted": len(one["parameters"]["fitted"]),
                "claims": [
                    {"of": one["columns"][claim["column"]]["words"], **{key: claim[key] for key in keys}}
                    for claim in one["claims"]
                ],
            }
            for name, one in found["experiments"].items()
        },
    }


def kept_speed(found: Table, folder: Path) -> dict[str, Any]:
    """The rows and the machine."""
    return dict(found)


KEPT: dict[str, Callable[[Table, Path], dict[str, Any]]] = {
    "cantilever": kept_calibration,
    "hexapod": kept_calibration,
    "millipede": kept_millipede,
    "validation": kept_validation,
    "speed": kept_speed,
}


def rounded(value: Any) -> Any:
    """Plain data with its floats to six digits."""
    if isinstance(value, dict):
        return {name: rounded(one) for name, one in value.items()}
    if isinstance(value, list):
        return [rounded(one) for one in value]
    return float(f"{value:.6g}") if isinstance(value, float) else value


def take(name: str, place: Path) -> Path:
    """Keep the part of a verb's result that the tables need."""
    command, file = COMMANDS[name]
    source = place / file if place.is_dir() else place
    found = json.loads(source.read_text(encoding="utf-8"))
    target = RESULTS / f"{name}.json"
    table = {"command": command, **rounded(KEPT[name](found, source.parent))}
    target.write_text(json.dumps(table, indent=1) + "\n", encoding="utf-8")
    return target


def result(name: str) -> dict[str, Any]:
    """A result as it was kept."""
    return json.loads((RESULTS / f"{name}.json").read_text(encoding="utf-8"))


# Words


def percent(share: float | None) -> str:
    return "–" if share is None else f"{100.0 * share:.1f} %"


def whole(share: float | None) -> str:
    return "–" if share is None else f"{100.0 * share:.0f} %"


def brier(score: float | None) -> str:
    return "–" if score is None else f"Brier score {score:.2f}"


def lines(head: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """A table of Markdown."""
    return (
        "\n".join(f"| {' | '.join(row)} |" for row in (head, ["---"] * len(head), *rows))
        .replace("| --- |", "|---|")
        .replace("--- |", "---|")
        .replace("| ---", "|---")
    )


def joined(words: Sequence[str]) -> str:
    """Words as a list in a sentence."""
    return words[0] if len(words) == 1 else f"{', '.join(words[:-1])} and {words[-1]}"


def sentence_of_choice(what: str, choice: Table, names: Mapping[str, str]) -> str:
    """How far a table decides a choice, with the weights of its options."""
    weights = sorted(choice["weights"].items(), key=lambda one: -one[1])
    told = ", ".join(
        f"{100.0 * weight:.0f} % for {names.get(option, option)}" for option, weight in weights if weight >= 0.005
    )
    return f"The data {'do not decide' if choice['open'] else 'decide'} {what} ({told})"


LANDINGS = {
    "restitute": "restitution first",
    "capture": "held unless pulled",
    "printed": "the source's rule with its own signs",
}
POLARITIES = {"lifting": "0 to 10 V lifting", "pressing": "0 to 10 V pressing", "both": "−10 to 10 V"}
AVERAGES = {"apex": "mean apex", "time": "time mean"}


def both_parts(summary: Table) -> tuple[Table, Table | None, Table | None]:
    """Measures as fitted, as left out, and of the best device; None where a result has none."""
    left, best = summary.get("left_out"), summary.get("best")
    return summary["training"]["measures"], left and left["measures"], best and best["measures"]


# The cantilever


def source_model() -> dict[str, Any]:
    """The source's own model against the measurement, from the packaged table."""
    from tarsus_reproduce.compared import merits_of
    from tarsus_reproduce.rows import CANTILEVER, packaged_rows

    rows = packaged_rows(CANTILEVER)
    pairs = {
        one: [(row.seen("measured", one), row.seen("source", one)) for row in rows] for one in CANTILEVER.quantities
    }
    return {one.studied: merits_of(one, pairs[one]) for one in CANTILEVER.quantities}


def naive(experiment: str, studied: str) -> dict[str, float]:
    """Errors of predictors that know the other measured rows of an experiment's table alone."""
    from tarsus.calibrate.results import naive_by_measure
    from tarsus_reproduce.ensembles import packaged_study

    return naive_by_measure(packaged_study(experiment))[studied]


def cantilever() -> str:
    """Rows of Table A.1: the source's model, fitted, left out."""
    found, source = result("cantilever"), source_model()
    fitted, left, best = both_parts(found["summary"])
    of_best = {
        name: f" (best device {percent(best[name]['mean_relative_error'])})" if best else ""
        for name in ("peak", "contact")
    }
    existence = (
        ""
        if best is None
        else (f" (best device: {best['bounces']['existence_right']} of {best['bounces']['cells']} right)")
    )
    rows = [
        [
            f"{words}, mean absolute error",
            percent(source[name]["mean_absolute_error"]),
            percent(fitted[name]["mean_relative_error"]) + of_best[name],
            percent(left and left[name]["mean_relative_error"]),
        ]
        for name, words in (("peak", "peak"), ("contact", "contact duration"))
    ]
    for key, words in (("peak", "peak"), ("contact", "contact duration")):
        for name, error in naive("cantilever", key).items():
            skill = "–" if left is None else f"skill {1.0 - left[key]['mean_relative_error'] / error:+.2f}"
            rows.append([f"{words}, by the {name.removeprefix('the ')} alone", f"{100.0 * error:.1f} %", "", skill])
    rows.append(
        [
            "existence of bounces",
            f"{source['bounces']['existence_right']} of {source['bounces']['cases']} right",
            brier(fitted["bounces"]["brier"]) + existence,
            brier(left and left["bounces"]["brier"]),
        ]
    )
    rows.append(
        [
            "number of bounces, mean error",
            f"{source['bounces']['mean_absolute_error']:.1f}",
            f"{fitted['bounces']['mean_absolute_error']:.1f}",
            "–" if left is None else f"{left['bounces']['mean_absolute_error']:.1f}",
        ]
    )
    held = [None if one is None else one["held"] for one in map(found["summary"].get, ("training", "left_out"))]
    rows.append(["values in the 80 % interval", "", *map(whole, held)])
    head = ["against the measurement", "dissertation's model", "`cantilever`, calibrated on", "left out"]
    choice = sentence_of_choice("which landing rule holds", found["choices"]["landing"], LANDINGS)
    return f"{lines(head, rows)}\n\n{choice}."


# The hexapod


def source_error_of_hexapod(rows: int) -> float:
    """Mean relative error of the source's model over all numbers of the fitted rows."""
    from tarsus_reproduce.rows import HEIGHTS, packaged_rows, relative_error

    errors = [
        relative_error(one.measured[name], one.source[name])
        for one in packaged_rows(HEIGHTS)[:rows]
        for name in ("bounces_per_s", "peak_um", "mean_um")
    ]
    known = [abs(error) for error in errors if error is not None]
    return sum(known) / len(known)


def hexapod() -> str:
    """The two rows of Table 3.2 in sentences."""
    found = result("hexapod")
    fitted, left, best = both_parts(found["summary"])
    kept = sum(not one["dropped"] for one in found["branches"])
    count = max(one["cells"] for one in fitted.values())
    source = source_error_of_hexapod(count)

    def each(part: Table) -> str:
        return ", ".join(
            f"{words} {whole(part[name]['mean_relative_error'])}"
            for name, words in (("bounces", "bounces"), ("peak", "peak"), ("mean", "height"))
        )

    said = [
        sentence_of_choice("the polarity", found["choices"]["polarity"], POLARITIES),
        sentence_of_choice('the meaning of "average height"', found["choices"]["average"], AVERAGES),
    ]
    text = f"{'. '.join(said)}; {kept} of {len(found['branches'])} branches fit."
    text += f" Mean errors of the mixture's medians: {each(fitted)}"
    if best is not None:
        size = sum(one["mean_relative_error"] for one in best.values()) / len(best)
        text += f"; of the best device {whole(size)} over all {count * len(best)} numbers"
    text += f" (dissertation's model: {whole(source)} over all {count * len(fitted)} numbers)."
    if left is not None:
        text += f" Errors of each row left out: {each(left)}; of the other row alone, taken for it: {by_other_row()}."
    return text


def by_other_row() -> str:
    """Errors of the hexapod's measured row that is not predicted, taken for the other."""
    words = {"bounces": "bounces", "peak": "peak", "mean": "height"}
    return ", ".join(f"{word} {whole(min(naive('hexapod', key).values()))}" for key, word in words.items())


# The millipede


CHOSEN = {"millipede": "`millipede` (chosen among interpretations)"}


def millipede() -> str:
    """Trends of section 4.4.1 by device, and over random readings."""
    found = result("millipede")
    counts = ("agree", "contradict", "insensitive", "not_determined")
    rows = [
        [words, motion, *(str(one[key]) for key in counts), f"{one['directional_agree']} of {one['directional_total']}"]
        for name, words in CHOSEN.items()
        for motion, one in found["variants"][name].items()
    ]
    first = next(iter(found["variants"].values()))
    readings, total = found["readings"], next(iter(first.values()))["directional_total"]
    at_most = f"{readings['agree']['quantile_95']:g}"
    rows.append(
        [
            f"{readings['judged']} random interpretations of what is not printed, mean (95 % agree with at most "
            f"{at_most})",
            "from rest, 10 periods",
            *(f"{readings[key]['mean']:.1f}" for key in counts),
            f"{readings['directional_agree']['mean']:.1f} of {total}",
        ]
    )
    head = [
        "device",
        "measured over",
        "agrees",
        "contradicts",
        "insensitive",
        "not determined",
        "directional trends that agree",
    ]
    return lines(head, rows)


# Experiments of others


def validation() -> str:
    """A row a claim that fails: how many rows, and how badly they agree; how many there are in all."""
    found = result("validation")
    claims = [(name, claim) for name, one in found["experiments"].items() for claim in one["claims"]]
    rows = [
        [
            f"`{name}`",
            claim["name"].replace("_", " "),
            claim["of"],
            str(claim["rows"]),
            tiny(claim["median_error"]),
            tiny(claim["bias"]),
        ]
        for name, claim in claims
        if claim["outcome"] != "holds"
    ]
    head = ["experiment", "claim", "of", "rows", "median error", "bias"]
    fitted = sum(one["fitted"] for one in found["experiments"].values())
    counts = f"{len(found['experiments'])} experiments, {found['numbers']} measured numbers, {fitted} fitted numbers"
    return f"{lines(head, rows)}\n\n{len(claims) - len(rows)} claims hold. {counts}."


def experiments() -> str:
    """A row an experiment: measured numbers, fitted ones, errors of claims that hold, and how many fail."""
    found, rows = result("validation"), []
    for one in found["experiments"].values():
        held = [claim for claim in one["claims"] if claim["outcome"] == "holds"]
        errors = [claim["median_error"] for claim in held if claim["median_error"] is not None]
        ends = dict.fromkeys(map(tiny, (min(errors), max(errors)))) if errors else {}
        failed = len(one["claims"]) - len(held)
        rows.append([one["title"], f"{one['fitted']}", " to ".join(ends) or "–", str(len(held)), str(failed)])
    head = ["experiment", "fitted numbers", "median errors of claims that hold", "claims that hold", "fail, as known"]
    return f"{lines(head, rows)}\n\n{found['numbers']} measured numbers of others."


def tiny(share: float | None) -> str:
    """A share in percent, or a word where it is rounding."""
    return "–" if share is None else "rounding" if abs(share) < 1e-9 else f"{100.0 * share:.3g} %"


# How fast it is


GOALS = {"P1": 10.0, "P2": 5.0}
"""How many times faster than heyoka each problem should be solved."""


def speed() -> str:
    """P1 and P2 beside heyoka, and which goals are met."""
    found = result("speed")
    rows, met, missed = [], [], []
    for problem in dict.fromkeys(one["problem"] for one in found["rows"]):
        own, peer = (
            next(one for one in found["rows"] if one["problem"] == problem and (one["solver"] == "tarsus") is mine)
            for mine in (True, False)
        )
        kind, _, size = problem.partition(" n=")
        unit = "ms" if own["unit"] == "ms/s" else "runs/s"
        name = f"{kind}, {size} masses" if size else f"{kind}, {own['checked'].replace('members', 'runs')} of 200 ms"
        wrong = [one["wrong"] for one in (own, peer)]
        rows.append(
            [
                f"{name}, {wrong[0]} wrong" if wrong[0] == wrong[1] else f"{name}, {wrong[0]} and {wrong[1]} wrong",
                *(
                    f"{one['median']:.3g} {unit}" if one["median"] < 1000.0 else f"{one['median']:.0f} {unit}"
                    for one in (own, peer)
                ),
                f"{peer['ratio']:.1f}",
            ]
        )
        of_kind = f"{size} masses" if size else f"{own['checked'].split()[0]} runs"
        (met if peer["ratio"] >= GOALS[kind] else missed).append(f"{kind} with {of_kind}")
    load = found["environment"]["load"]
    where = f"{found['environment']['cores']} processors, load {load[0]:.1f}" if load else "a machine of unknown load"
    goals = f"Our goals are {GOALS['P1']:g} times heyoka on P1 and {GOALS['P2']:g} times on P2:"
    said = [f"{word} on {joined(names)}" for word, names in (("met", met), ("missed", missed)) if names]
    goals += f" {', '.join(said)}."
    return f"{lines(['', 'Tarsus', 'heyoka', 'ratio'], rows)}\n\nMedians on {where}. {goals}"


def fast() -> str:
    """How many times faster than heyoka, in a sentence."""
    peers = [one for one in result("speed")["rows"] if one["solver"] != "tarsus"]
    one_run = sorted(one["ratio"] for one in peers if one["problem"].startswith("P1"))
    (many,) = [one["ratio"] for one in peers if not one["problem"].startswith("P1")]
    return (
        f"One run takes {one_run[0]:.0f} to {one_run[-1]:.0f} times less CPU time than by heyoka, the fastest public "
        f"peer we know, and thousands of runs {many:.0f} times less ([tables](docs/agreement.md#how-fast-it-is))."
    )


TABLES: dict[str, Callable[[], str]] = {
    "validation": validation,
    "experiments": experiments,
    "fast": fast,
    "cantilever": cantilever,
    "hexapod": hexapod,
    "millipede": millipede,
    "speed": speed,
}

_PLACE = re.compile(r"(<!-- figures: ([\w-]+) -->\n)(?:(?!<!--).)*(<!-- end -->)", re.DOTALL)


def filled(text: str) -> str:
    """A page with its tables as the results have them."""
    return _PLACE.sub(lambda found: f"{found[1]}{TABLES[found[2]]()}\n{found[3]}", text)


def page_differences() -> list[str]:
    """Pages whose tables are others than the results', a sentence each."""
    return [
        f"{page.relative_to(ROOT)}: run `python docs/figures.py`"
        for page in PAGES
        if filled(page.read_text(encoding="utf-8")) != page.read_text(encoding="utf-8")
    ]


def mixture_differences() -> list[str]:
    """Packaged mixtures that are of another calibration than the results, a sentence each."""
    from tarsus_reproduce.ensembles import packaged_errors

    told = []
    for name in ("cantilever", "hexapod"):
        mine, theirs = result(name)["summary"], packaged_errors(name) or {}
        if any(theirs.get(part) != one for part, one in mine.items()):
            told.append(
                f"the packaged mixture of {name} is not of the calibration of docs/results/{name}.json: package "
                f"the folder of one `{COMMANDS[name][0]}` (`python docs/package_mixtures.py`), and take the same"
            )
    return told


def main(arguments: Sequence[str] | None = None) -> int:
    """Write, check, or take a result; the exit code."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--check", action="store_true", help="write nothing; say what differs")
    verbs = parser.add_subparsers(dest="verb")
    taking = verbs.add_parser("take", help="keep what the tables need of a verb's result")
    taking.add_argument("name", choices=list(COMMANDS))
    taking.add_argument("place", type=Path)
    options = parser.parse_args(arguments)
    if options.verb == "take":
        print(f"wrote {take(options.name, options.place)}")
    if options.check:
        told = [*page_differences(), *mixture_differences()]
        print("\n".join(told) or "pages, results and packaged mixtures agree")
        return 1 if told else 0
    for page in PAGES:
        page.write_text(filled(page.read_text(encoding="utf-8")), encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
