"""The walking millipede: trends with the numbers behind them, scores, and the page."""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np
import pytest

import tarsus as ts
from reproduce.coarse_studies import FEW, overdamped, ringing
from tarsus.study.studyfile import load_sweep
from tarsus_reproduce.millipede import (
    Coarse,
    MillipedeReproduction,
    Outcome,
    Score,
    Swept,
    damping_ratio,
    judge_scene,
    reproduce_millipede,
    stands,
)
from tarsus_reproduce.millipede_trends import (
    DIRECTIONAL,
    PAYLOAD,
    TRENDS,
    FilmReading,
    examples,
    scored_trends,
)
from tarsus_reproduce.pages.millipede import millipede_html
from tarsus_reproduce.trends import Verdict
from unit.html_page import Page


@pytest.fixture(scope="module")
def found() -> MillipedeReproduction:
    scenes = {"overdamped": overdamped(), "ringing": ringing()}
    return MillipedeReproduction(
        tuple(judge_scene(name, scene, coarse=FEW, duration=0.06) for name, scene in scenes.items())
    )


def verdict(outcome: Outcome, figure: str, measure: str, says: str = "falls") -> Verdict:
    (one,) = [
        one
        for one in outcome.trends
        if (one.trend.figure, one.measure, one.trend.says) == (figure, measure, says)
    ]
    return one.finding.verdict


def swept(outcome: Outcome, study: str) -> Swept:
    return next(one for one in outcome.swept if one.study == study)


def test_there_are_16_trends_of_which_11_are_directional():
    for reading in FilmReading:
        scored = scored_trends(reading)
        assert len(scored) == 15
        assert [trend.study for trend in scored if trend.figure == "4.9"] == [reading.study]
    assert DIRECTIONAL == 11
    assert all(trend.measures[0] in ("max_peak",) for trend in TRENDS if "legs" in trend.quantity)


def test_scores_count_every_trend_once(found):
    assert found.ok
    for outcome in found.outcomes:
        assert outcome.score.total == 16 and outcome.score.directional_total == 11
        assert len(outcome.trends) == sum(len(trend.measures) for trend in TRENDS)
    agree, no, still = Verdict.AGREES, Verdict.CONTRADICTS, Verdict.INSENSITIVE
    assert Score.of([(agree, True), (agree, False), (no, True), (still, False)]) == Score(2, 1, 1, 0, 1, 2)


def test_a_device_is_judged_in_its_own_reading_of_the_film(found):
    over, rings = found.outcomes
    assert (over.reading, rings.reading) == (FilmReading.MICRO, FilmReading.NANO)
    assert not stands(over.scene) and stands(rings.scene)
    assert damping_ratio(over.scene) == pytest.approx(1.858, abs=1e-3)
    plain = found.to_dict()["variants"]["ringing"]
    other = [one for one in plain["trends"] if one["quantity"] == "travel, film in uN m^2 s"]
    assert other and not any(one["scored"] for one in other)
    assert sum(one["scored"] for one in plain["trends"]) == 15


def test_what_does_not_change_is_insensitive_and_not_contradicted(found):
    """Each line of physics is checked against the curve itself, not against the verdict's own rules."""
    over = found.outcomes[0]
    heave, stride = (swept(over, PAYLOAD).values[name] for name in ("max_heave", "stride"))
    assert (np.diff(heave, axis=0) < 0.0).all() and verdict(over, "4.11", "max_heave") is Verdict.AGREES
    assert (np.diff(stride, axis=0) > 0.0).all() and verdict(over, "4.11", "stride") is Verdict.CONTRADICTS
    film = swept(over, FilmReading.MICRO.study).values["stride"]
    assert np.ptp(film) < 1e-3 * film.mean()
    inert = [one for one in over.trends if one.trend.reading and one.measure == "stride"]
    assert {one.finding.verdict for one in inert} == {Verdict.INSENSITIVE}


def test_every_payload_of_a_standing_device_starts_in_its_own_equilibrium(found):
    """Undriven, a body that stands never rises; from another payload's start a lighter one would spring up."""
    rings = found.outcomes[1].scene
    still = ts.with_values(rings, {"gait.high": 0.0})
    batch = ts.simulate_batch(still, {"robot.structure.body.mass": [0.05e-6, 0.5e-6]}, 0.01)
    sag = 9.80665 / (2.0 * rings.robot.structure.legs["L1"].stiffness_v)
    heave = np.array([batch.run(k).marks["body"][:, 1] for k in range(2)])
    np.testing.assert_allclose(heave, -sag * np.array([[0.05e-6], [0.5e-6]]) * np.ones_like(heave), rtol=1e-3)
    assert np.isfinite(swept(found.outcomes[1], PAYLOAD).values["max_heave"]).all()


def test_what_is_scored_alone_is_judged_alike(found):
    whole = found.outcomes[0]
    alone = judge_scene("overdamped", overdamped(), coarse=FEW, duration=0.06, scored_only=True)
    assert alone.score == whole.score
    every = {(one.trend, one.measure): one.finding for one in whole.trends}
    assert [one.trend for one in alone.trends] == scored_trends(whole.reading)
    assert all(repr(one.finding) == repr(every[one.trend, one.measure]) for one in alone.trends)
    assert {name for one in alone.swept for name in one.values} == {one.measure for one in alone.trends}


def test_figure_4_7_body_stands_on_the_sticky_ground(found):
    outcome = found.outcomes[0]
    first, second = outcome.examples
    assert first.amplitude > 5e-6 and second.amplitude < 1e-9
    much, attraction, adhesion = outcome.comparisons
    assert much.verdict is Verdict.AGREES and adhesion.verdict is Verdict.AGREES
    assert attraction.verdict is not Verdict.AGREES


def test_grounds_and_ranges_are_those_printed():
    """Table 4.2 and Fig. 4.7: C_e in nN m^2/V^2, C_sfd in nN m^2 s as printed and in uN m^2 s (E4), C_adh in N/s."""
    nano, micro = 1e-9, 1e-6
    for reading, unit in ((FilmReading.NANO, nano), (FilmReading.MICRO, micro)):
        first, second = examples(reading)["a"], examples(reading)["b"]
        assert first["ground.electrostatic.coefficient"] == pytest.approx(1e-8 * nano)
        assert second["ground.electrostatic.coefficient"] == pytest.approx(1e-12 * nano)
        assert first["ground.film.coefficient"] == pytest.approx(1e-18 * unit)
    ranges = {
        "millipede-electrostatics": (1e-13 * nano, 1e-7 * nano),
        "millipede-film-nano": (1e-18 * nano, 1e-15 * nano),
        "millipede-film-micro": (1e-18 * micro, 1e-15 * micro),
        "millipede-adhesion": (1e-8, 0.1),
        "millipede-payload": (0.05e-6, 0.5e-6),
    }
    for name, ends in ranges.items():
        sweep = load_sweep(name)
        path, restitution = sweep.vary
        assert sweep.vary[path].ends == pytest.approx(ends, rel=1e-12)
        assert sweep.vary[restitution].ends == (0.1, 0.9) and sweep.seconds == 0.2
        judged = {m for trend in TRENDS if trend.study == name for m in trend.measures}
        assert judged <= set(sweep.measures)


def test_plain_data_holds_every_count_verdict_and_curve(found):
    plain = found.to_dict()
    assert plain["ok"] and "Spearman" in plain["criterion"]
    assert list(plain["variants"]) == ["overdamped", "ringing"]
    for variant, outcome in zip(plain["variants"].values(), found.outcomes, strict=True):
        counts = [variant[name] for name in ("agree", "contradict", "insensitive", "not_determined")]
        assert sum(counts) == 16 and variant["directional_agree"] <= variant["directional_total"] == 11
        for entry, one in zip(variant["trends"], outcome.trends, strict=True):
            assert entry["verdict"] == one.finding.verdict.value and entry["unit"] in ("m", "s", "1")
            curve = variant["curves"][one.trend.study]
            assert (
                np.shape(curve["measures"][entry["measure"]])
                == (9, 2)
                == (
                    len(curve["x"]),
                    len(curve["restitution"]),
                )
            )


# Slow: eight figures drawn. The page from the command line is among the fast tests.
@pytest.mark.slow
def test_the_page_is_whole_and_needs_nothing_from_outside(found):
    text = millipede_html(found)
    page = Page(text)
    headings = ("Trends", "Over ground and payload", "Two grounds in time")
    positions = [page.text.index(words) for words in headings]
    assert positions == sorted(positions)
    figures = [int(n) for n in re.findall(r"<b>Figure (\d+)\.</b>", text)]
    assert figures == list(range(1, 9))  # one of them the readings
    assert not {"link", "img"} & set(page.tags) and ("script", "src") not in {
        one[:2] for one in page.attributes
    }
    assert not re.findall(r"url\((?!#)", text) and "nan" not in page.text
    assert "insensitive" in page.text and "agrees" in page.text and "0 of 11" not in page.text


def test_a_device_whose_numbers_were_chosen_for_its_score_says_so_beside_it(found):
    assert "no validation" not in found.outcomes[0].about
    chosen = replace(found.outcomes[0], scene=ts.load_scene("millipede"))
    assert "chosen within the range of random readings so that these trends come out" in chosen.about
    assert chosen.about in Page(millipede_html(MillipedeReproduction((chosen,)))).text


def test_devices_that_are_no_walkers_are_refused():
    with pytest.raises(ts.InputError, match="a millipede is a walker"):
        reproduce_millipede("cantilever")


def test_what_the_printed_landing_shows_on_few_grounds():
    """Fast sibling of the slow one below: trends that are not near their limits, at two restitutions."""
    outcome = judge_scene(
        "millipede-printed",
        ts.load_scene("millipede-printed"),
        coarse=Coarse(13, (0.1, 0.9)),
        scored_only=True,
    )
    assert not outcome.problems
    shown = {
        (one.trend.figure, one.measure)
        for one in outcome.trends
        if one.trend.directional and one.finding.verdict is Verdict.AGREES
    }
    assert shown >= {
        ("4.8", "max_heave"), ("4.8", "max_peak"), ("4.8", "max_surge"), ("4.8", "total_rebounds_any_height"),
        ("4.11", "max_heave"), ("4.11", "max_surge"),
    }  # fmt: skip
    assert outcome.comparisons[0].verdict is Verdict.AGREES
    bounces = swept(outcome, "millipede-electrostatics").values["total_rebounds_any_height"]
    assert (bounces[-3:].mean(axis=0) > bounces[:3].mean(axis=0)).all()


@pytest.mark.slow
def test_packaged_variants_are_judged_over_the_whole_studies():
    """Each on every trend and all values; how many agree is no test, for their numbers were chosen for it."""
    whole = reproduce_millipede()
    assert whole.ok
    assert [outcome.name for outcome in whole.outcomes] == [
        "millipede",
        "millipede-table",
        "millipede-printed",
    ]
    for outcome in whole.outcomes:
        assert outcome.score.total == 16
        assert swept(outcome, PAYLOAD).values["max_heave"].shape == (37, 5)
        judged = [one.trend for one in outcome.trends if one.measure == one.trend.measures[0]]
        assert [judged.count(trend) for trend in scored_trends(outcome.reading)] == [1] * 15
        assert "no validation" in outcome.about
