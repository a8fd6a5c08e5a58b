"""Random scenes against the independent simulator of ``tests/independent``, event by event.

    python benchmarks/independent.py edges FILE --count 60
    python benchmarks/independent.py falling-friction FILE --count 400 [--legged]

``edges``: structures whose feet adhere, under square edges. ``falling-friction``: feet that slide on a law of Stribeck
or of weakening by rate, with a reference speed of 1e-8 to 0.1 m/s; of structures, or of walkers.

Every scene is a line of FILE, and a survey that was stopped goes on where it was. A comparison goes as far as an error
of the size of a step's has not grown 1e5 times (`independent.compare`); what differs before that is named in its line.
"""

from __future__ import annotations

import argparse
import json
import signal
import sys
import time
from collections.abc import Callable
from pathlib import Path

import tarsus as ts
from tarsus.model.scene import Scene

sys.path.insert(0, str(Path(__file__).parents[1] / "tests"))
from independent.compare import compare
from random_scenes import edge_scene, falling_friction, plain_scene, sliding_scene

TIGHT = ts.Accuracy(gap=1e-10, drive=1e-11)
LEAST, STOPS = 1e-7, 1e-6
"""[rad of the fastest mode] to which times agree under friction that falls; the begin of sticking, of slips that hardly
stop."""


def on_falling_friction(seed: int, legged: bool) -> Scene:
    scene = plain_scene(seed, True) if legged else sliding_scene(seed)
    return ts.with_values(scene, {"ground.friction": falling_friction(seed)})


def compared(make: Callable[[], Scene], bounds: tuple[float, ...], limit: float) -> dict[str, object]:
    """What a comparison found; or why there is none: longer than ``limit`` [s of CPU], a run that does not end well."""

    def give_up(*_: object) -> None:
        raise TimeoutError(f"longer than {limit:g} s")

    signal.signal(signal.SIGVTALRM, give_up)
    signal.setitimer(signal.ITIMER_VIRTUAL, limit)
    begun = time.process_time()
    try:
        found = compare(make(), TIGHT, *bounds)
        out: dict[str, object] = {"events": found.events, "compared": found.compared, "wrong": found.wrong}
        out |= {"undetermined": True} if found.undetermined else {}
    except Exception as error:  # any: the line tells it, and the survey goes on
        out = {"none": f"{type(error).__name__}: {error}"}
    finally:
        signal.setitimer(signal.ITIMER_VIRTUAL, 0.0)
    return out | {"seconds": round(time.process_time() - begun, 1)}


def summary(rows: list[dict]) -> str:
    whole = [row for row in rows if "none" not in row]
    wrong = [row["seed"] for row in whole if row["wrong"]]
    shared = [row["seed"] for row in whole if "undetermined" in row]
    lines = [
        f"{len(rows)} scenes, {len(whole)} compared: {sum(row['compared'] for row in whole)} of "
        f"{sum(row['events'] for row in whole)} events lie within the horizon, "
        f"{sum(row['compared'] == row['events'] for row in whole)} scenes to their end",
        f"{len(wrong)} differ: {wrong}; {len(shared)} once the motion does not say what each foot bears: {shared}",
    ]
    lines += [f"seed {row['seed']}: {row['none']}" for row in rows if "none" in row]
    return "\n".join(lines)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("kind", choices=["edges", "falling-friction"])
    parser.add_argument("file", type=Path)
    parser.add_argument("--count", type=int, default=60)
    parser.add_argument("--first", type=int, default=0, help="first seed")
    parser.add_argument("--legged", action="store_true", help="walkers")
    parser.add_argument("--limit", type=float, default=120.0, help="seconds of CPU a scene")
    given = parser.parse_args()
    rows = [json.loads(line) for line in given.file.read_text().splitlines()] if given.file.exists() else []
    done = {row["seed"] for row in rows}
    for seed in range(given.first, given.first + given.count):
        if seed in done:
            continue
        if given.kind == "edges":
            found = compared(lambda seed=seed: edge_scene(seed), (), given.limit)
        else:
            found = compared(lambda seed=seed: on_falling_friction(seed, given.legged), (LEAST, STOPS), given.limit)
        rows.append({"seed": seed, **found})
        with given.file.open("a") as file:
            file.write(json.dumps(rows[-1]) + "\n")
    print(summary(rows))


if __name__ == "__main__":
    main()
