"""Walkers: time of a second of model time, and how it grows with the number of legs.

    python benchmarks/walking.py                 # packaged walkers, scaling, batch
    python benchmarks/walking.py --legs 6 30 60

Without friction a walker can also be run by contact modes, Tarsus' other engine; on the smallest that is the peer in
the same run, and every event of both is compared before a time is printed. CPU time of one thread, best of the repeats.
"""

from __future__ import annotations

import argparse
import math
import time
from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

import tarsus as ts
from tarsus.base.events import EventKind
from tarsus.model.scene import Scene
from tarsus.plan.lowering import lower_scene
from tarsus.plan.rows import rows_of
from tarsus.solve import SINGLE_RUN, Engine
from tarsus.solve.codes import structured_events
from tarsus_reproduce.walkers import many_legs

TOLERANCE = 1e-9  # of event times [s] between the two engines


def best(call: Callable[[], object], repeats: int) -> float:
    """Least CPU time of a call [s]."""
    times = []
    for _ in range(repeats):
        begun = time.process_time()
        call()
        times.append(time.process_time() - begun)
    return min(times)


def second(scene: Scene, duration: float, repeats: int) -> tuple[float, float, int]:
    """CPU seconds of a second of model time: of the engine alone, and of `simulate` with all it prepares; events."""
    plan = lower_scene(scene)
    made, rows = Engine(plan, duration), rows_of(plan)
    events = len(made.run(rows, SINGLE_RUN).events)
    engine = best(lambda: made.run(rows, SINGLE_RUN), repeats) / duration
    return engine, best(lambda: ts.simulate(scene, duration), repeats) / duration, events


def beside_modes(scene: Scene, duration: float, repeats: int) -> tuple[float, float, int]:
    """CPU seconds a second of both engines on a walker without friction, after comparing every event."""
    smooth = ts.with_values(scene, {"ground.friction": None})
    plan = lower_scene(smooth)
    legged, modal = Engine(plan, duration), Engine(replace(plan, legs=None), duration)

    def by_legs() -> np.ndarray:
        return structured_events(legged.run(rows_of(plan), SINGLE_RUN).events)

    def by_modes() -> np.ndarray:
        return structured_events(modal.run(rows_of(plan), SINGLE_RUN).events)

    one, two = (events[events["kind"] != EventKind.PERIOD_MARK] for events in (by_legs(), by_modes()))
    same = one[["kind", "foot"]].tolist() == two[["kind", "foot"]].tolist()
    if not same or np.abs(one["time"] - two["time"]).max() > TOLERANCE:
        raise SystemExit("the two engines disagree: no times")
    return best(by_legs, repeats) / duration, best(by_modes, repeats) / duration, len(one)


def main(arguments: Sequence[str] | None = None) -> None:
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--legs", type=int, nargs="+", default=[4, 8, 16, 30, 60])
    parser.add_argument("--repeats", type=int, default=3)
    parser.add_argument("--runs", type=int, default=500, help="runs of the batch")
    chosen = parser.parse_args(arguments)
    ts.simulate(ts.load_scene("millipede"), 1e-3)  # compiles
    print("walker           legs  events/s  engine ms/s  simulate ms/s")
    for name in ("millipede", "millipede-30"):
        scene = ts.load_scene(name)
        engine, whole, events = second(scene, 1.0, chosen.repeats)
        print(f"{name:16s} {len(scene.robot.feet):4d} {events:9d} {1e3 * engine:12.1f} {1e3 * whole:14.1f}")
    print("\nscattered legs (10 %), 0.2 s")
    before: tuple[int, float] | None = None
    for legs in chosen.legs:
        scene = many_legs(legs, scatter=0.1, seed=1)
        engine, _, events = second(scene, 0.2, chosen.repeats)
        grown = (
            ""
            if before is None
            else f"   exponent {math.log(engine / before[1]) / math.log(legs / before[0]):.2f}"
        )
        each = f"{1e3 * engine:8.1f} ms/s  {1e3 * engine / legs:6.2f} ms/s a leg"
        print(f"{legs:4d} legs  {events:6d} events  {each}{grown}")
        before = legs, engine
    legs_s, modes_s, events = beside_modes(ts.load_scene("millipede"), 0.2, chosen.repeats)
    print(f"\nwithout friction, {events} events the same in both engines")
    print(f"by legs {1e3 * legs_s:.1f} ms/s, by contact modes {1e3 * modes_s:.1f} ms/s")
    values = np.logspace(-22, -16, chosen.runs)
    scene = ts.load_scene("millipede")
    begun, cpu = time.perf_counter(), time.process_time()
    ts.simulate_batch(scene, {"ground.electrostatic.coefficient": values}, 0.2)
    cpu, wall = time.process_time() - cpu, time.perf_counter() - begun
    print(
        f"batch of {chosen.runs} runs of 0.2 s: {1e3 * cpu / chosen.runs:.2f} ms CPU a run, {wall:.1f} s in all"
    )


if __name__ == "__main__":
    main()
