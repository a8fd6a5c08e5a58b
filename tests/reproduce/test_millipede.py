"""Reproduction of the walking millipede: variants, trends with the numbers behind them, and its page."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest
from html_page import Page

import tarsus as ts
from reproduce.coarse_studies import few_runs
from tarsus.study.studyfile import load_sweep
from tarsus_reproduce.millipede import (
    EXAMPLES,
    RINGING,
    TRENDS,
    MillipedeReproduction,
    damping_ratio,
    reproduce_millipede,
    variants_of,
)
from tarsus_reproduce.pages.millipede import millipede_html
from tarsus_reproduce.trends import Verdict


@pytest.fixture(scope="module")
def found() -> MillipedeReproduction:
    with few_runs():
        return reproduce_millipede(duration=0.06)


def test_variants_differ_in_what_they_say():
    described, ringing, free = variants_of(ts.load_scene("millipede"))
    assert damping_ratio(described.scene) == pytest.approx(1.858, abs=1e-3)
    assert damping_ratio(ringing.scene) == pytest.approx(RINGING)
    assert ringing.scene.ground == described.scene.ground
    assert free.scene.ground.adhesion is None and free.scene.robot == ringing.scene.robot
    (alone, _) = variants_of(ringing.scene)
    assert alone.name == "as described"
    with pytest.raises(ts.InputError, match="a millipede is a walker"):
        variants_of(ts.load_scene("cantilever"))


def test_every_trend_is_judged_on_every_variant_that_has_its_law(found):
    assert found.ok and len(found.outcomes) == 3
    rows = sum(len(trend.measures) for trend in TRENDS)
    adhesion = sum(len(trend.measures) for trend in TRENDS if trend.figure == "4.10")
    assert [len(outcome.trends) for outcome in found.outcomes] == [rows, rows, rows - adhesion]
    assert [len(outcome.examples) for outcome in found.outcomes] == [2, 2, 0]
    assert {trend.figure for trend in TRENDS} == {"4.8", "4.9", "4.10", "4.11"}
    for outcome in found.outcomes:
        assert sum(outcome.count(verdict) for verdict in Verdict) == len(
            {(one.trend.figure, one.trend.quantity, one.trend.says) for one in outcome.trends}
        )


def verdicts(found: MillipedeReproduction, variant: int, figure: str, measure: str) -> list[Verdict]:
    trends = found.outcomes[variant].trends
    return [one.finding.verdict for one in trends if (one.trend.figure, one.measure) == (figure, measure)]


def test_the_millipede_as_described_agrees_and_contradicts(found):
    """Each line of physics is checked against the curve itself, not against the verdict's own rules."""
    described = found.outcomes[0]
    payload = next(one for one in described.swept if one.study == "millipede-payload")
    heave, stride = payload.values["max_heave"], payload.values["stride"]
    assert (np.diff(heave, axis=0) < 0.0).all() and (np.diff(stride, axis=0) > 0.0).all()
    assert verdicts(found, 0, "4.11", "max_heave") == [Verdict.AGREES]
    assert verdicts(found, 0, "4.11", "stride") == [Verdict.CONTRADICTS]
    film = next(one for one in described.swept if one.study == "millipede-film")
    assert np.ptp(film.values["stride"]) < 1e-4 * film.values["stride"].mean()
    assert verdicts(found, 0, "4.9", "stride") == [Verdict.CONTRADICTS]
    counts = {one.study: one.values["total_bounces"].max() for one in described.swept}
    assert counts.pop("millipede-electrostatics") > 0.0, "captures that let go by themselves"
    assert set(counts.values()) == {0.0}
    assert verdicts(found, 0, "4.8", "total_bounces") == [Verdict.NOT_DETERMINED, Verdict.CONTRADICTS]


def test_lower_damping_lets_the_body_jump_higher_and_electrostatics_hold_it(found):
    described, ringing, free = (
        next(one for one in outcome.swept if one.study == "millipede-electrostatics")
        for outcome in found.outcomes
    )
    assert ringing.values["max_heave"][0].min() > 4.0 * described.values["max_heave"][0].max()
    assert verdicts(found, 1, "4.8", "max_heave")[0] is Verdict.AGREES
    assert free.values["impacts"].mean() > 5.0 * ringing.values["impacts"].mean()


def test_figure_4_7_body_stands_on_the_sticky_ground(found):
    first, second = found.outcomes[0].examples
    assert first.amplitude > 5e-6 and second.amplitude < 1e-9
    assert abs(second.stride) < 1e-9 < first.stride
    much, because = found.outcomes[0].comparisons
    assert much.verdict is Verdict.AGREES and because.verdict is not Verdict.AGREES
    assert 1.0 < because.ratio < 2.0


def test_grounds_and_ranges_are_those_printed():
    """Table 4.2 and Fig. 4.7: C_e in nN m^2/V^2, C_sfd in uN m^2 s (E4) and in nN m^2 s, C_adh in N/s."""
    nano, micro = 1e-9, 1e-6
    assert EXAMPLES["a"]["ground.electrostatic.coefficient"] == pytest.approx(1e-8 * nano)
    assert EXAMPLES["b"]["ground.electrostatic.coefficient"] == pytest.approx(1e-12 * nano)
    assert EXAMPLES["a"]["ground.film.coefficient"] == pytest.approx(1e-18 * micro)
    ranges = {
        "millipede-electrostatics": (1e-13 * nano, 1e-7 * nano),
        "millipede-film": (1e-18 * nano, 1e-15 * micro),
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


def test_plain_data_holds_every_verdict_and_its_curve(found):
    plain = found.to_dict()
    assert plain["ok"] and plain["device"] == "millipede" and "Spearman" in plain["criterion"]
    for variant, outcome in zip(plain["variants"], found.outcomes, strict=True):
        assert sum(variant["verdicts"].values()) <= len(TRENDS)
        for entry, one in zip(variant["trends"], outcome.trends, strict=True):
            assert entry["verdict"] == one.finding.verdict.value and entry["unit"] in ("m", "s", "1")
            curve = variant["curves"][one.trend.study]
            assert np.shape(curve["measures"][entry["measure"]]) == (
                len(curve["x"]),
                len(curve["restitution"]),
            )


def test_the_page_is_whole_and_needs_nothing_from_outside(found):
    text = millipede_html(found)
    page = Page(text)
    positions = [
        page.text.index(words) for words in ("Trends", "Over ground and payload", "Two grounds in time")
    ]
    assert positions == sorted(positions)
    figures = [int(n) for n in re.findall(r"<b>Figure (\d+)\.</b>", text)]
    assert figures == [1, 2, 3, 4, 5, 6]
    assert not {"script", "link", "img"} & set(page.tags)
    assert not re.findall(r"url\((?!#)", text) and "nan" not in page.text
    assert page.text.count("contradicts") >= 10 and "agrees" in page.text


@pytest.mark.slow
def test_the_walking_page_says_what_is_found():
    whole = reproduce_millipede()
    page = (Path(__file__).parents[2] / "docs" / "walking.md").read_text(encoding="utf-8")
    for verdict in Verdict:
        counts = " | ".join(str(outcome.count(verdict)) for outcome in whole.outcomes)
        assert f"\n| {verdict.value} | {counts} |" in page
    ratios = [outcome.comparisons[1].ratio for outcome in whole.outcomes[:2]]
    assert f"they alone make {ratios[0]:.2f} times | not determined: {ratios[1]:.1f} times" in page
    described, ringing = (
        {(one.trend.figure, one.measure): one.finding for one in o.trends} for o in whole.outcomes[:2]
    )
    for finding, factor, unit in (
        (described["4.8", "max_surge"], 1e6, "µm"),
        (ringing["4.8", "max_surge"], 1e6, "µm"),
        (described["4.11", "max_surge"], 1e6, "µm"),
        (ringing["4.11", "max_heave"], 1e6, "µm"),
    ):
        assert f"{finding.first * factor:.3g} to {finding.last * factor:.3g} {unit}" in page
