"""Measures of many runs at once, against plain loops over the events of one foot."""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np
import pytest

import tarsus as ts
from measure.test_measure import BOUNCE, CAPTURE, MARK, RELEASE, REST, START, Hand
from tarsus.measure import Judgement, RunTable, Scope, measured, measures_of
from tarsus.measure.periods import PER_WINDOW, PerWindow
from tarsus.solve.codes import EVENT_TYPE
from tarsus.solve.run import Run


def random_run(rng: np.random.Generator, feet: int) -> Hand:
    """Feet that fly, bounce and stay in any order that is possible; some times coincide with ends of periods."""
    end = float(rng.choice([1.0, 4.0, 3.3]))
    tables = []
    for foot in range(feet):
        count = int(rng.integers(0, 30))
        own = np.zeros(count, EVENT_TYPE)
        times = rng.uniform(0.0, end, count)
        own["time"] = np.sort(np.round(times * 8) / 8 if rng.random() < 0.3 else times).clip(0.0, end)
        down = False
        for k in range(count):
            if k == 0 and rng.random() < 0.3:
                own[k]["time"], own[k]["kind"], down = 0.0, START, True
                continue
            chances = [RELEASE, MARK] if down else [BOUNCE, BOUNCE, CAPTURE, REST, MARK]
            own[k]["kind"] = kind = rng.choice(chances)
            down = down if kind == MARK else kind in (CAPTURE, REST)
        own["foot"] = foot
        grounded = np.isin(own["kind"], (RELEASE, START)) | on_ground(own["kind"])
        own["apex"] = np.where(rng.random(count) < 0.7, 10.0 ** rng.uniform(-9, -5, count), 0.0) * ~grounded
        own["apex_time"] = np.maximum(own["time"] - rng.uniform(0.0, 0.1, count), 0.0)
        own["speed_before"] = rng.uniform(0.0, 1.0, count)
        own["gap_integral"] = np.cumsum(rng.uniform(0.0, 1e-6, count))
        tables.append(own)
    events = np.concatenate([np.zeros(0, EVENT_TYPE), *tables])
    reached = end if rng.random() < 0.6 else float(rng.uniform(0.0, end))
    events = events[events["time"] <= reached]
    events = events[np.argsort(events["time"], kind="stable")]
    return Hand(events, reached, float(rng.choice([1.0, 0.5, 0.3, 10.0])), tuple("abcde"[:feet]))


def on_ground(kinds: np.ndarray) -> np.ndarray:
    """Whether each event is a period mark of a foot that stands."""
    out, down = np.zeros(len(kinds), dtype=bool), False
    for k, kind in enumerate(kinds):
        out[k] = down and kind == MARK
        down = down if kind == MARK else kind in (CAPTURE, REST, START)
    return out


def one_table(runs: list[Hand]) -> RunTable:
    first = np.cumsum([0, *(len(run.all_events) for run in runs)])
    return RunTable(
        np.concatenate([run.all_events for run in runs]),
        first,
        runs[0].foot_names,
        np.array([run.end_time for run in runs]),
        np.array([run.period for run in runs]),
        np.zeros(len(runs), dtype=int),
        lambda _: None,
    )


class Plain:
    """What a foot did, event by event."""

    def __init__(self, run: Hand, foot: int, height: float, dwell: float) -> None:
        self.end, self.height, self.dwell = run.end_time, height, dwell
        self.flights: list[dict[str, float]] = []
        self.impacts: list[tuple[float, float]] = []
        self.tops: list[tuple[float, float]] = []
        events = [one for one in run.all_events if one["foot"] == foot]
        touching = [one["kind"] for one in events if one["kind"] != MARK]
        flying: dict[str, float] | None = None
        if not touching or touching[0] not in (START, RELEASE):
            flying = self._begin(0.0, born=1.0, rebound=0.0)
        for one in events:
            kind, time, apex = one["kind"], float(one["time"]), float(one["apex"])
            if apex > 0.0:
                self.tops.append((float(one["apex_time"]), apex))
                if flying is not None and kind != RELEASE and apex >= flying["apex"]:
                    flying["apex"], flying["apex_time"] = apex, float(one["apex_time"])
            if kind in (BOUNCE, CAPTURE, REST):
                self.impacts.append((time, float(one["speed_before"])))
                if flying is not None:
                    flying["end"], flying["lands"] = time, 1.0
                flying = None
            if kind in (BOUNCE, RELEASE):
                flying = self._begin(time, born=0.0, rebound=float(kind == BOUNCE))

    def _begin(self, time: float, born: float, rebound: float) -> dict[str, float]:
        flight = {"start": time, "end": self.end, "apex": 0.0, "apex_time": time, "born": born, "lands": 0.0}
        self.flights.append(flight | {"rebound": rebound})
        return self.flights[-1]

    @property
    def seen(self) -> list[dict[str, float]]:
        return [one for one in self.flights if one["born"] or one["apex"] > self.height]

    @property
    def bounces(self) -> list[float]:
        return [b["start"] for a, b in pairwise(self.seen) if b["start"] - a["end"] < self.dwell]

    def rebounds(self, height: float) -> list[float]:
        return [one["start"] for one in self.flights if one["rebound"] and one["apex"] > height]

    @property
    def contacts(self) -> list[tuple[float, float]]:
        found, since = [], 0.0
        for one in self.seen:
            if not one["born"]:
                found.append((since, one["start"]))
            since = one["end"]
        aloft = bool(self.seen) and self.seen[-1] is self.flights[-1] and not self.seen[-1]["lands"]
        return found if aloft else [*found, (since, self.end)]


def of_foot(plain: Plain, edges: list[float]) -> dict[str, list[float]]:
    """Measures of a foot in every period."""
    out: dict[str, list[float]] = {}
    for k, (a, b) in enumerate(pairwise(edges)):
        last = k == len(edges) - 2

        def inside(time: float, a: float = a, b: float = b, last: bool = last) -> bool:
            return a <= time < b or (last and time == b)

        def rises(time: float, a: float = a, b: float = b) -> bool:
            return a <= time * (1 - 1e-12) < b and time >= edges[0]

        speeds = [v for t, v in plain.impacts if inside(t)]
        hops = [one["apex"] for one in plain.seen if not one["born"] and inside(one["apex_time"])]
        contact = math.fsum(max(min(b, end) - max(a, start), 0.0) for start, end in plain.contacts)
        tops = [top for t, top in plain.tops if rises(t)]
        nothing = 0.0 if contact > 0.999999 * (b - a) else math.nan
        row = {
            "bounces": float(sum(map(inside, plain.bounces))),
            "rebounds": float(sum(map(inside, plain.rebounds(plain.height)))),
            "contact_duration": contact,
            "duty_factor": contact / (b - a),
            "peak": max(tops, default=nothing),
            "mean_apex": sum(hops) / len(hops) if hops else math.nan,
            "impacts": float(len(speeds)),
            "impact_speed": sum(speeds) / len(speeds) if speeds else math.nan,
            "hardest_impact": max((v for t, v in plain.impacts if rises(t)), default=math.nan),
        }
        for name, value in row.items():
            out.setdefault(name, []).append(value)
    return out


def in_whole_run(plain: Plain) -> dict[str, float]:
    return {
        "max_peak": max((top for _, top in plain.tops), default=math.nan),
        "total_bounces": float(len(plain.bounces)),
        "total_rebounds": float(len(plain.rebounds(plain.height))),
        "total_rebounds_any_height": float(len(plain.rebounds(0.0))),
        "longest_contact": max((end - start for start, end in plain.contacts), default=0.0),
    }


def mean(values: list[float]) -> float:
    known = [value for value in values if math.isfinite(value)]
    return sum(known) / len(known) if known else math.nan


@pytest.mark.parametrize("feet", [1, 3])
def test_every_measure_is_what_plain_loops_find(feet):
    rng = np.random.default_rng(feet)
    runs = [random_run(rng, feet) for _ in range(60)]
    found = measured(Judgement(one_table(runs), height=3e-8))
    compared = 0
    for r, run in enumerate(runs):
        count = max(math.floor(run.end_time / run.period * (1 + 1e-9)), 1)
        dropped = (count + 2) // 3 if count > 1 else 0
        edges = [k * run.period for k in range(dropped, count + 1)]
        if count == 1:
            edges[1] = min(run.period, run.end_time)
        for f, name in enumerate(run.foot_names):
            plain = Plain(run, f, 3e-8, min(5e-4, 0.1 * run.period))
            expected = {key: mean(rows) for key, rows in of_foot(plain, edges).items()} | in_whole_run(plain)
            for key, value in expected.items():
                one = found[key].of(r).per_foot[name]
                assert one == pytest.approx(value, rel=1e-9, abs=1e-15, nan_ok=True), (r, name, key)
                compared += math.isfinite(value)
    assert compared > 500 * feet


@pytest.mark.parametrize("feet", [1, 2, 5])
def test_runs_beside_each_other_change_nothing_to_the_last_bit(feet):
    rng = np.random.default_rng(10 + feet)
    runs = [random_run(rng, feet) for _ in range(30)]
    options = {"skip": 0, "height": 1e-8, "dwell": 0.2}
    every = measured(Judgement(one_table(runs), **options))
    some = measured(Judgement(one_table(runs[7:19][::-1]), **options))
    for r, run in enumerate(runs):
        alone = measures_of(run, **options)
        assert list(alone) == list(every)
        for name, one in alone.items():
            assert repr(every[name].of(r)) == repr(one)
            if 7 <= r < 19:
                assert repr(some[name].of(18 - r)) == repr(one)


def test_a_measure_that_is_added_is_one_of_runs_batches_and_sweeps(monkeypatch):
    def shortest(seen):
        flights, hops = seen.flights, seen.histories.hops(seen.counting.height)
        found, cell = seen.inside(flights.own[hops], flights.start[hops])
        out = np.full(seen.windows.cell[-1], np.nan)
        np.fmin.at(out, cell, (flights.end[hops] - flights.start[hops])[found])
        return out

    words = "shortest flight that begins in a {span} and clears {height}"
    monkeypatch.setitem(PER_WINDOW, "shortest_flight", PerWindow("s", Scope.MEAN, words, shortest))
    scene = ts.load_scene("cantilever")
    run = ts.simulate(scene, 0.06)
    assert run.measures.shortest_flight.definition.startswith(
        "shortest flight that begins in a drive period and clears 0.1"
    )
    assert 0.0 < run.measures.shortest_flight.value < 0.02
    batch = ts.simulate_batch(scene, {}, 0.06)
    assert batch.measure("shortest_flight")[0] == pytest.approx(run.measures.shortest_flight.value, rel=1e-4)
    assert "shortest_flight" in Run.offered(scene, 0.06)


def test_a_rest_that_is_told_late_takes_its_place():
    late = np.zeros(3, EVENT_TYPE)
    late["time"], late["kind"] = [0.5, 2.0, 1.0], [BOUNCE, REST, RELEASE]
    late["apex"][:2] = 1e-6
    run = Hand(late, 3.0, 3.0, ("a",))
    found = measured(Judgement(RunTable.of(run)))["contact_duration"].value
    assert found.tolist() == [2.0], "in the air until 1 s, when it is let go to no height"
