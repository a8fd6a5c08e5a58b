"""The walking millipede: trends with the numbers behind them, scores, and what is shown of them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import tarsus as ts
from reproduce.coarse_studies import FEW, overdamped, ringing
from tarsus.orbits.motion import FromRest, SettledMotion
from tarsus.orbits.scored import scored
from tarsus.solve.run import Shared
from tarsus.study.studyfile import load_sweep
from tarsus_reproduce.claims import DIRECTIONAL, GROUNDS, TRENDS, FilmUnit, examples, of_episode, scored_trends
from tarsus_reproduce.millipede import DeviceTrends, damping_ratio, judge_devices, judge_scene, score_of, stands
from tarsus_reproduce.millipede_tables import millipede_reproduction
from tarsus_reproduce.trends import TrendVerdict

AGREES, CONTRADICTS = TrendVerdict.AGREES, TrendVerdict.CONTRADICTS


@pytest.fixture(scope="module")
def found() -> tuple[DeviceTrends, ...]:
    scenes = {"overdamped": overdamped(), "ringing": ringing()}
    return tuple(judge_scene(name, scene, coarse=FEW, duration=0.06) for name, scene in scenes.items())


def verdict(device: DeviceTrends, figure: str, measure: str, says: str = "falls") -> TrendVerdict:
    (one,) = [
        one for one in device.trends if (one.trend.figure, one.measure, one.trend.says) == (figure, measure, says)
    ]
    return one.finding.verdict


def swept(device: DeviceTrends, study: str) -> dict[str, np.ndarray]:
    """Values of a study by measure."""
    (found,) = [one for one in device.swept if one.study == study]
    return {name: one.curve.y for name, one in found.measures.items()}


def test_a_device_is_scored_on_episodes_alone():
    """The overdamped one on few short runs: all 16 trends, each counted once."""
    over = judge_scene("overdamped", overdamped(), coarse=FEW, duration=0.02, scored_only=True)
    assert not over.problems and (over.film, over.lasting) == (FilmUnit.MICRO, None)
    assert sum([*over.score.values()][:4]) == 16 and over.score["directional_total"] == DIRECTIONAL == 11
    assert [one.trend for one in over.trends] == scored_trends(FilmUnit.MICRO)
    heave = swept(over, "millipede-payload")["max_heave"]
    assert (np.diff(heave, axis=0) < 0.0).all() and verdict(over, "4.11", "max_heave") is AGREES
    no, still = CONTRADICTS, TrendVerdict.INSENSITIVE
    assert [*score_of([(AGREES, True), (AGREES, False), (no, True), (still, False)]).values()] == [2, 1, 1, 0, 1, 2]


@pytest.mark.slow
def test_a_device_is_judged_in_its_own_unit_of_the_film(found):
    over, rings = found
    assert (over.film, rings.film) == (FilmUnit.MICRO, FilmUnit.NANO)
    assert not stands(over.scene) and stands(rings.scene)
    assert damping_ratio(over.scene) == pytest.approx(1.858, abs=1e-3)
    own = [one for one in rings.trends if one.trend.quantity == "travel, film in uN m^2 s"]
    assert own and not any(rings.scores(one.trend) for one in own)
    assert sum(one.of_figure and rings.scores(one.trend) for one in rings.trends) == 16


@pytest.mark.slow
def test_what_does_not_change_is_insensitive_and_not_contradicted(found):
    """Each line of physics is checked against the curve itself, not against the verdict's own rules."""
    over = found[0]
    heave, stride = (swept(over, "millipede-payload")[name] for name in ("max_heave", "stride"))
    assert (np.diff(heave, axis=0) < 0.0).all() and verdict(over, "4.11", "max_heave") is AGREES
    assert (np.diff(stride, axis=0) > 0.0).all() and verdict(over, "4.11", "stride") is CONTRADICTS
    film = swept(over, "millipede-film-micro")["stride"]
    assert np.ptp(film) < 1e-3 * film.mean()
    inert = [one for one in over.trends if one.trend.film and one.measure == "stride"]
    assert {one.finding.verdict for one in inert} == {TrendVerdict.INSENSITIVE}


@pytest.mark.slow
def test_measures_of_a_period_are_judged_over_the_settled_motion(found):
    for device in found:
        assert device.motions == ("from rest, 60 ms", "settled motion, runs of 1 s from 4 starts")
        for one in device.trends:
            assert isinstance(one.motion, FromRest) == of_episode(one.measure)
        lasting = [one for one in device.trends if one.lasting and device.scores(one.trend)]
        assert [one.trend for one in lasting] == scored_trends(device.film)
        assert (
            device.lasting is not None and sum([*device.lasting.values()][:4]) == 16 and device.lasting != device.score
        )
    scene, whole = found[1].scene, next(one for one in found[1].swept if one.study == "millipede-payload")
    values = {whole.path: whole.x[[2]], "ground.restitution.coefficient": whole.replicates[[1]]}
    alone = scored(SettledMotion(1.0, 4), scene, values, ("stride",), Shared())
    assert whole.measures["stride"].curve.y[2, 1] == alone.value[0, 0]
    within, between = alone.spread[0, 0], alone.over_starts[0, 0]
    assert whole.measures["stride"].curve.spread[2, 1] == pytest.approx(np.hypot(within, between / 2.0))


@pytest.mark.slow
def test_figure_4_7_body_stands_on_the_sticky_ground(found):
    for measure in ("vertical_amplitude_from_rest", "vertical_amplitude"):
        values = swept(found[0], GROUNDS)[measure]
        assert values[0, 0] > 5e-6 and values[1, 1] < 1e-9
        own = [one.finding for one in found[0].trends if one.trend.figure == "4.7" and one.measure == measure]
        much, attraction, adhesion = (one.verdict for one in own)
        assert much is AGREES and adhesion is AGREES and attraction is not AGREES


def test_grounds_and_ranges_are_those_printed():
    """Table 4.2 and Fig. 4.7: C_e in nN m^2/V^2, C_sfd in nN m^2 s as printed and in uN m^2 s (E4), C_adh in N/s."""
    nano, micro = 1e-9, 1e-6
    for film, unit in ((FilmUnit.NANO, nano), (FilmUnit.MICRO, micro)):
        first, second = examples(film)["a"], examples(film)["b"]
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


@pytest.mark.slow
def test_a_device_whose_numbers_were_chosen_for_its_score_says_so_beside_it(found):
    assert "no validation" not in found[0].about
    chosen = replace(found[0], scene=ts.load_scene("millipede"))
    assert "no validation" in chosen.about
    assert chosen.about in millipede_reproduction((chosen,)).table().text()


def test_devices_that_are_no_walkers_are_refused():
    with pytest.raises(ts.InputError, match="a millipede is a walker"):
        judge_devices("cantilever")


@pytest.mark.slow
def test_packaged_variants_are_judged_over_the_whole_studies():
    """Each on every trend and all values; how many agree is no test, for their numbers were chosen for it."""
    whole = judge_devices()
    assert [device.name for device in whole] == ["millipede", "millipede-table", "millipede-printed"]
    for device in whole:
        assert not device.problems and sum([*device.score.values()][:4]) == 16 and "no validation" in device.about
        assert swept(device, "millipede-payload")["max_heave"].shape == (37, 5)
