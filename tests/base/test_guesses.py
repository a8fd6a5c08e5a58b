"""What users type first: short words for numbers, and names that are guessed."""

import inspect
from typing import Any

import numpy as np
import pytest

import tarsus as ts
import wrong_inputs
from tarsus.atlas.axis import MapAxis
from tarsus.atlas.result import Atlas
from tarsus.base.quantities import Quantity
from tarsus.base.spec import by_path, get_value, one_number, paths_of
from tarsus.calibrate.calibrating import Calibration
from tarsus.design import Design, LandingDesign
from tarsus.modes.modal import ModalFit
from tarsus.orbits.attractors import Attractors
from tarsus.orbits.branches import Branches
from tarsus.records.measurement import Channel

AMPLITUDE, FREQUENCY = "signals.pzt.amplitude", "signals.pzt.frequency"


@pytest.fixture(scope="module")
def beam() -> ts.Scene:
    return ts.load_scene("cantilever")


@pytest.fixture(scope="module")
def run(beam: ts.Scene) -> ts.Run:
    return ts.simulate(beam, "20 ms", volts=6)


@pytest.fixture(scope="module")
def batch(beam: ts.Scene) -> ts.Batch:
    return ts.simulate_batch(beam, {"volts": ["4 V", "6 V"]}, "20 ms")


def two_signals(scene: ts.Scene) -> ts.Scene:
    """The scene with a second drive, which has a signal of its own."""
    other = scene.robot.drives["pzt"]
    changed = ts.with_values(scene, {"robot.drives": {"pzt": other, "other": other}})
    waves = {name: ts.Sine(amplitude=4, frequency=hz) for name, hz in (("pzt", 50), ("other", 60))}
    return ts.with_values(changed, {"signals": waves})


def test_short_words_stand_for_paths_wherever_these_do(beam: ts.Scene, batch: ts.Batch, run: ts.Run) -> None:
    assert list(batch.vary) == [AMPLITUDE] and batch.vary[AMPLITUDE].tolist() == [4.0, 6.0]
    assert batch.run(1).measures["peak"].value == pytest.approx(run.measures["peak"].value, abs=2e-9)
    assert ts.with_values(beam, {"hz": "77 Hz"}).signals["pzt"].frequency == 77.0
    assert get_value(beam, "volts") == get_value(beam, AMPLITUDE)
    assert one_number(beam, "hz") == FREQUENCY
    assert ts.Session(beam).run({"volts": 5}, "1 ms").scene.signals["pzt"].amplitude == 5.0
    study = ts.Sweep(name="x", scene=beam, vary={"volts": ["4 V", 6]}, measures=("peak",), duration="20 ms")
    assert study.paths("volts") == (AMPLITUDE,)
    assert MapAxis.of(beam, ("volts", 4, "8 V")).path == AMPLITUDE
    slopes = ts.simulate(beam, "5 ms", gradients=["volts"])
    exact = ts.simulate(beam, "5 ms", gradients=[AMPLITUDE])
    assert slopes.gradient("ledger.work_in")["volts"] == exact.gradient("ledger.work_in")[AMPLITUDE]


def test_a_walkers_words_are_its_gaits() -> None:
    walker = ts.load_scene("millipede")
    assert paths_of(walker, "volts") == ("gait.high",) and paths_of(walker, "hz") == ("gait.frequency",)


def test_a_word_moves_all_signals_together(beam: ts.Scene) -> None:
    both = two_signals(beam)
    assert by_path(both, {"volts": 3.0}) == {"signals.pzt.amplitude": 3.0, "signals.other.amplitude": 3.0}
    grid = ts.simulate_batch(both, {"volts": [3, 4], "robot.feet.tip.gap": [60e-6, 70e-6, 80e-6]}, "1 ms", grid=True)
    assert grid.shape == (2, 3) and grid.to_dataset(["impacts"])["impacts"].shape == (2, 3)
    assert grid.vary["signals.other.amplitude"].tolist() == grid.vary[AMPLITUDE].tolist()
    assert get_value(both, "volts") == 4.0


def test_a_run_draws_what_is_named(run: ts.Run, batch: ts.Batch) -> None:
    gap = run.plot("gap")
    assert gap.get_ylabel().startswith("gap") and np.array_equal(gap.lines[0].get_ydata(), run.gap[0])
    assert [run.plot().get_ylabel(), ts.plot(run).get_ylabel()] == ["displacement (µm)"] * 2
    assert run.plot("impacts").get_ylabel().startswith("approach speed")
    assert ts.plot(run, "gap").get_ylabel() == gap.get_ylabel()
    assert ts.plot(batch, "peak").get_ylabel().startswith("peak")


def test_measures_of_runs_and_batches_are_asked_alike(run: ts.Run, batch: ts.Batch) -> None:
    for name in ("contact_duration", "contact duration"):
        one, all_ = run.measures[name], batch.measures[name]
        assert all_.value[1] == batch.measures(1)[name].value == batch.measure(name)[1]
        assert all_.value[1] == pytest.approx(one.value, rel=1e-6)
        assert all_.unit == one.unit == "s"
    assert list(batch.measures) == list(run.measures)
    with pytest.raises(KeyError, match="did you mean 'peak'"):
        batch.measures["peek"]


def test_a_measure_says_no_spread_that_is_rounding(beam: ts.Scene) -> None:
    assert "(spread 0 s, n = 6)" in str(ts.simulate(beam).measures["contact duration"])


ATTRIBUTES = {
    "run": [
        ("to_dataframe", "to_dataset"),
        ("measurs", "'measures'"),
        ("nothing_alike", "valid names are"),
        ("volts", r"series\['volts'\]"),
        ("peak", r"measures\['peak'\]"),
    ],
    "batch": [
        ("results", "'measured'"),
        ("measur", "'measure'"),
        ("gap", r"run\(i\).gap"),
        ("peak", r"measures\['peak'\]"),
    ],
    "tarsus": [("open", "load_scene"), ("simulat", "'simulate'")],
    "scene": [("robt", "'robot'")],
    "feet": [("tp", "'tip'")],
}


@pytest.mark.parametrize(("owner", "name", "said"), [(o, *one) for o, many in ATTRIBUTES.items() for one in many])
def test_names_that_are_none_are_answered_with_the_right_one(
    owner: str, name: str, said: str, run: ts.Run, batch: ts.Batch, beam: ts.Scene
) -> None:
    asked = {"run": run, "batch": batch, "tarsus": ts, "scene": beam, "feet": beam.robot.feet}[owner]
    with pytest.raises(AttributeError, match=said):
        getattr(asked, name)
    assert not hasattr(asked, name)


def test_an_error_inside_a_property_is_not_taken_for_an_unknown_name(run: ts.Run, monkeypatch) -> None:
    monkeypatch.setattr(ts.Run, "ended", property(lambda self: self.log.no_such_thing))
    with pytest.raises(AttributeError, match="no_such_thing"):
        run.ended  # noqa: B018


def batch_of(**vary: list[Any]) -> wrong_inputs.Ask:
    return lambda at: ts.simulate_batch(
        "cantilever", {path.replace("__", "."): of for path, of in vary.items()}, "1 ms"
    )


def fitted(unknowns: Any) -> wrong_inputs.Ask:
    return lambda at: ts.fit("cantilever", unknowns, lambda run: [0.0], "1 ms")


def stepped(volts: Any) -> object:
    session = ts.Session("cantilever")
    session.reset()
    return session.step(volts, "2 ms")


def verb(name: str, **options: Any) -> wrong_inputs.Ask:
    first = next(iter(inspect.signature(getattr(ts, name)).parameters))
    return lambda at: getattr(ts, name)(**{first: "cantilever", **options})


NO_NUMBERS = ("ground.gravity", "ground.film", "robot.feet.tip.point")
WRONG: dict[str, tuple[wrong_inputs.Ask, wrong_inputs.Said]] = {
    "volts for a duration": (
        lambda at: ts.simulate("cantilever", {"volts": 6}),  # type: ignore[arg-type]
        ("duration: expected a time", "got {'volts': 6}", "volts=6"),
    ),
    "a word of two values": (
        lambda at: get_value(two_signals(ts.load_scene("cantilever")), "hz"),
        ("signals.pzt.frequency and ", "signals.other.frequency", "differ"),
    ),
    "a word of two numbers": (
        lambda at: one_number(two_signals(ts.load_scene("cantilever")), "volts"),
        ("volts: stands for ", "; name one of them"),
    ),
    "no word": (batch_of(voltage=[1.0]), "voltage: unknown path; did you mean 'volts'"),
    "no path": (batch_of(xyz=[1.0]), ("xyz: unknown path; valid names are ", "short words are 'volts', 'hz'")),
    "a word and its path": (
        batch_of(volts=[1.0], signals__pzt__amplitude=[2.0]),
        f"{AMPLITUDE}: is given twice, once as 'volts'",
    ),
    "slopes by no numbers": (
        lambda at: ts.simulate("cantilever", "1 ms", gradients=[*NO_NUMBERS]),
        (
            "ground.gravity: is not set here, so it has no value that could vary",
            "such as ground.film.coefficient",
            "robot.feet.tip.point: is 'tip', and no number that varies",
        ),
    ),
    "unknown of one number": (fitted({"volts": 5}), "volts: expected (low, high), got 5"),
    "unknown by its last name": (fitted({"gap": (1, 2)}), "has no number 'gap'; did you mean 'robot.feet.tip.gap'"),
    "unknown in a list": (fitted(["volts"]), ("unknowns: expected each as tarsus.Unknown(", "got 'volts'")),
    "no unknown": (fitted({}), "expected at least one"),
    "no folder of a run": (lambda at: ts.load_run(at / "out"), "there is no folder"),
    "no such series": (lambda at: ts.simulate("cantilever", "1 ms").plot("gaps"), "did you mean 'gap'"),
    "volts of no drive": (
        lambda at: stepped(6),
        "drive: expected volts by the drives' names, such as {'pzt': 6}, got 6",
    ),
    "batch of nothing that varies": (
        lambda at: ts.simulate_batch("cantilever", volts=[5, 6]),
        "vary: missing; expected values by path, as ts.simulate_batch(scene, {'volts': [...]})",
    ),
    "sweep of a mapping": (
        lambda at: ts.sweep({"scene": "x"}, output=at),  # type: ignore[arg-type]
        ("got a dict", "ts.Sweep("),
    ),
    "scene of a run": (
        lambda at: ts.attractors(ts.simulate("cantilever", "1 ms")),  # type: ignore[arg-type]
        "scene: expected a Scene, a name or a path, got a Run",
    ),
    "page of another ending": (
        lambda at: ts.explore("cantilever", at / "x.gif"),
        "x.gif': expected a name ending in .html",
    ),
    "scene of nothing": (lambda at: ts.simulate(None), "scene: expected a Scene, a name or a path, got None"),  # type: ignore[arg-type]
    "part of a start": (verb("attractors", starts=2.5), "starts: expected a whole number, got 2.5"),
    "seed below 0": (verb("identify", seed=-1), "seed: expected a whole number of 0 or more, got -1"),
    "no threads": (verb("validate", threads=0), "threads: expected a whole number of 1 or more, got 0"),
    "text for a flag": (verb("attractors", edges="no"), "edges: expected True or False, got 'no'"),
    "text for a number": (verb("synthesize", output="x", snr_db="40 dB"), "snr_db: expected a number, got '40 dB'"),
    "number for a text": (verb("recommend", budget=1, parameter=3), "parameter: expected a text, got 3"),
    "number for a folder": (verb("report", folder=3), "folder: expected a name or a path, got 3"),
    "one end of a range": (verb("explore", over={"volts": 5}), "over: expected both ends of every range, got {'volts'"),
    "range of no path": (verb("branch", along="volts"), "along: expected ranges by path, as {"),
    "values of no name": (verb("recommend", budget=1, vary="volts"), "vary: expected values by name"),
    "axis of no ends": (verb("atlas", x="volts"), "x: expected a path and both ends"),
    "one count": (verb("yield_", dead=1), "dead: expected fewest and most, as (0, 1), got 1"),
    "one end of a band": (lambda at: ts.modes("x.uff", band=5), "band: expected both ends of a range"),  # type: ignore[arg-type]
    "record of a number": (lambda at: ts.modes(3), ("sources: expected a Measurement, ", "a name or a path, got 3")),  # type: ignore[arg-type]
    "sweep of a device": (lambda at: ts.sweep("cantilever", {"volts": [4, 6, 8]}), ("ts.Sweep(", "ts.simulate_batch(")),
}


@wrong_inputs.cases(WRONG)
def test_wrong_input_is_a_sentence(ask: wrong_inputs.Ask, said: wrong_inputs.Said, tmp_path) -> None:
    wrong_inputs.is_refused(ask, said, tmp_path)


@pytest.mark.parametrize("ask", [ts.atlas, ts.yield_, ts.sweep, ts.calibrate])
def test_a_word_that_a_verb_does_not_take_is_answered_with_the_right_one(ask: Any) -> None:
    with pytest.raises(TypeError, match=r"unexpected keyword argument 'outptu'; did you mean 'output'\?"):
        ask("cantilever", outptu="x")


def test_a_path_of_a_message_is_python_too(beam: ts.Scene) -> None:
    assert beam.robot.feet.tip.gap == beam.robot.feet["tip"].gap  # type: ignore[attr-defined]
    assert Channel("tip", Quantity.VELOCITY).unit == "m/s"


def test_a_run_is_no_table_of_feet(run: ts.Run) -> None:
    with pytest.raises(TypeError, match=r"a run has no \['tip'\]: .*to_dataset.*measures.*gap .*\(tip\)"):
        run["tip"]


def test_numbers_of_arrays_stand_where_those_of_python_do() -> None:
    ends, one = np.array([8.0, 7.9]), np.float32(1.0)
    followed = ts.branch("cantilever", {"volts": ends}, starts=np.int64(0), multiple=one)  # type: ignore[arg-type, dict-item]
    assert followed.ends == (8.0, 7.9)


@pytest.mark.parametrize("result", [ts.Run, Branches, Attractors, Atlas, Design, LandingDesign, Calibration, ModalFit])
def test_results_are_written_into_a_folder_by_one_word(result: Any) -> None:
    assert inspect.signature(result.write).return_annotation == "Path" and not hasattr(result, "save")
