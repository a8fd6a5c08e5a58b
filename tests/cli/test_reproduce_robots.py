"""`reproduce hexapod` and `reproduce quadruped`: rows, summary, files, refusals."""

from __future__ import annotations

import csv
import json
import math
import tomllib

import pytest

EXTRA = "gap_um,wave,volt_v,freq_hz,bounces_exp_per_s,peak_exp_um,mean_exp_um\n8,square,6,40,100,20,\n"


@pytest.fixture(scope="module")
def written(tmp_path_factory, reproduced_once):
    """Three of the hexapod's mixture reproduced with one more row and two seeds: JSON printed, and the folder written
    to. Its page is drawn elsewhere: in reproduce/test_robot_page.py, and below for a map that creates energy."""
    from contextlib import redirect_stdout
    from io import StringIO

    from tarsus.cli import main
    from tarsus_reproduce import robots

    folder = tmp_path_factory.mktemp("hexapod")
    rows = folder / "rows.csv"
    rows.write_text(EXTRA, encoding="utf-8")
    out = StringIO()
    words = ["reproduce", "hexapod", "--rows", str(rows), "--seeds", "2", "--json"]
    few = robots.packaged_members("hexapod")[::6]
    with pytest.MonkeyPatch.context() as patch, redirect_stdout(out):
        patch.setattr(robots, "packaged_members", lambda robot: few)
        patch.setattr("tarsus_reproduce.pages.robot.write_robot_report", drawn)
        assert main([*words, "-o", str(folder / "out")]) == 0
    return json.loads(out.getvalue()), folder / "out"


def drawn(reproduction, runs, path):
    text = f"{reproduction.robot}, {len(reproduction.rows)} rows, {len(runs.near)} runs"
    path.write_text(text, encoding="utf-8")


def test_json(written):
    result, _ = written
    assert (result["robot"], result["ok"]) == ("hexapod", True)
    assert result["device"].startswith("hexapod, a mixture of ")
    assert [row["role"] for row in result["rows"]] == ["calibrated on"] * 2 + ["predicted"] * 2
    for row in result["rows"]:
        for who in ("ours", "without_small_forces"):
            assert set(row[who]) == {"bounces_per_s", "peak_um", "mean_um"}
            for name, one in row[who].items():
                if name == "mean_um" and None in one.values():  # an apex of flights where there are none
                    assert set(one.values()) == {None} and row[who]["bounces_per_s"]["median"] == 0.0
                    continue
                assert 0.0 <= one["low"] <= one["median"] <= one["high"] < math.inf
        ours, apex = row["ours"], row["mean_apex_um"]["median"]
        assert (ours["mean_um"]["median"] or 0.0) <= ours["peak_um"]["median"]
        assert apex is None or apex <= ours["peak_um"]["median"]
        assert 0.0 <= row["p_bounce"] <= 1.0
    added = result["rows"][3]
    assert (added["freq_hz"], added["measured"]["mean_um"]) == (40.0, None)
    assert added["errors"]["peak_um"] == pytest.approx((20.0 - added["ours"]["peak_um"]["median"]) / 20.0)
    assert result["summary"]["source"]["bounces_per_s"] == pytest.approx(27.885, abs=1e-3)


def test_json_of_modes_maps_and_air(written):
    result, _ = written
    assert max(result["modes"], key=lambda mode: mode["mac"])["number"] == 6
    assert all(row["passive_worst_gain"] <= 1.0 + 1e-9 for row in result["impact_maps"])
    energies = result["impact_energies"]
    assert energies["impacts"] > 0 and energies["own_sum_j"] < 0.0
    assert energies["by_map"]["mass-weighted"]["share_made"] == 0.0
    assert energies["by_map"]["printed"]["most_made_j"] > 0.0
    air = {one["volt_v"]: one["peak_to_peak_um"]["foot1"] for one in result["in_air"]}
    assert sorted(air) == [15.0, 20.0, 25.0, 30.0]
    assert air[30.0] / air[15.0] == pytest.approx(2.0, rel=1e-3)  # a linear structure on a linear drive


def test_files(written):
    result, folder = written
    assert json.loads((folder / "reproduction.json").read_text(encoding="utf-8")) == result
    with (folder / "reproduction.csv").open(encoding="utf-8", newline="") as stream:
        rows = list(csv.DictReader(stream))
    assert [row["role"] for row in rows] == [row["role"] for row in result["rows"]]
    assert float(rows[3]["peak_um_ours"]) == result["rows"][3]["ours"]["peak_um"]["median"]
    assert rows[3]["mean_um_measured"] == rows[3]["mean_um_source"] == ""
    assert (folder / "reproduction.html").read_text(encoding="utf-8") == "hexapod, 4 rows, 3 runs"


HEADINGS = ("calibrated on", "predicted", "bare", "Mean absolute error", "MAC", "passive", "In the air")


def test_tables_for_people(tarsus, written):
    result = tarsus("reproduce", "hexapod", "--rows", written[1].parent / "rows.csv", "--seeds", "2")
    assert result.code == 0 and not result.err
    assert all(words in result.out for words in HEADINGS)
    assert " nan" not in result.out


# Slow: all rows again. Its sibling above shows those of two seeds.
@pytest.mark.slow
def test_tables_of_one_seed_which_has_no_spread(tarsus):
    result = tarsus("reproduce", "hexapod", "--seeds", "1", "-q")
    assert result.code == 0 and not result.err
    assert all(words in result.out for words in HEADINGS)
    assert " nan" not in result.out


def test_the_quadruped_has_no_table_but_modes_maps_and_air(tarsus, reproduced_once):
    result = tarsus("reproduce", "quadruped", "--json").json()
    assert (result["robot"], result["rows"], len(result["modes"])) == ("quadruped", [], 5)
    (air,) = result["in_air"]
    assert (air["volt_v"], air["freq_hz"]) == (8.0, 15.0)
    assert list(air["peak_to_peak_um"]) == ["foot1", "foot2", "body", "foot3", "foot4"]
    assert "no table" in tarsus("reproduce", "quadruped").out


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["hexapod", "--seeds", "0"], "--seeds: expected a number from 1 to"),
        (["hexapod", "--seeds", "100000"], "--seeds: expected a number from 1 to"),
        (["hexapod", "--seeds", "few"], "--seeds"),
        (["cantilever", "--seeds", "3"], "only the robots have seeds"),
        (["hexapod", "--device", "hexapode"], "no device is called 'hexapode'"),
        (["hexapod", "--rows", "nowhere.csv"], "cannot read the rows file"),
    ],
)
def test_wrong_options_are_one_sentence(tarsus, words, said):
    result = tarsus("reproduce", *words)
    assert (result.code, result.out) == (2, "")
    (sentence,) = result.sentences
    assert said in sentence


def test_every_bad_row_is_a_sentence(tarsus, tmp_path):
    rows = tmp_path / "rows.csv"
    rows.write_text("wave,volt_v,gap_um,freq_hz\nsine,10,5,0\nsaw,10,5,\nsine,-1,5,\n", encoding="utf-8")
    result = tarsus("reproduce", "hexapod", "--rows", rows)
    assert (result.code, result.out) == (2, "")
    for sentence, said in zip(
        result.sentences, ("'freq_hz' must be", "'wave' must be", "'volt_v'"), strict=True
    ):
        assert said in sentence
    rows.write_text("wave,volt_v,gap_um,freq_hz\nsine,10,5,1e9\n", encoding="utf-8")
    (sentence,) = tarsus("reproduce", "hexapod", "--rows", rows).sentences
    assert "'freq_hz' can be at most" in sentence


def tables(robot, tmp_path):
    """The raw tables of a packaged robot without its provenance, to be spoiled."""
    from tarsus.files.library import load_scene
    from tarsus.files.toml import write_scene

    file = tmp_path / "whole.toml"
    write_scene(load_scene(robot), file)
    table = tomllib.loads(file.read_text(encoding="utf-8"))
    table.pop("provenance")
    return table


@pytest.fixture
def hexapod(tmp_path):
    return tables("hexapod", tmp_path)


def _feetless(table):
    table["robot"].pop("feet")


def _silent(table):
    table.pop("signals")


def _constant(table):
    table["signals"]["pzt"] = {"kind": "constant", "level": "3 V"}


@pytest.mark.parametrize(
    ("spoil", "said"),
    [(_feetless, "no foot"), (_silent, "no drive signal"), (_constant, "does not repeat")],
)
@pytest.mark.parametrize("robot", ["hexapod", "quadruped"])
def test_a_device_that_cannot_bounce_is_refused(tarsus, save, tmp_path, robot, spoil, said):
    spoil(table := tables(robot, tmp_path))
    result = tarsus("reproduce", robot, "--device", save(table))
    assert (result.code, result.out) == (2, "")
    (sentence,) = result.sentences
    assert said in sentence


# Slow: a run that diverges, and its page.
@pytest.mark.slow
def test_a_map_that_creates_energy_is_announced_and_its_divergence_ends_with_1(
    tarsus, save, hexapod, tmp_path
):
    from tarsus_reproduce.impacts import printed_column

    column = dict(
        zip(hexapod["robot"]["structure"]["shapes"], printed_column("hexapod").tolist(), strict=True)
    )
    hexapod["ground"]["impact"] = {"kind": "given", "columns": {"foot1": column}, "passive": False}
    hexapod["robot"]["structure"]["damping_ratios"] = [0.002] * 6  # so little that the energy made stays
    hexapod["robot"]["drives"]["pzt"]["law"]["gain"] = "2.3 uN/V"
    hexapod["signals"]["pzt"] |= {"amplitude": "10 V", "offset": "0 V", "frequency": "85 Hz"}
    result = tarsus("reproduce", "hexapod", "--device", save(hexapod), "--seeds", "1", "-o", tmp_path / "out")
    assert result.code == 1
    assert "This map can create energy" in result.out
    assert all("The run stopped" in sentence for sentence in result.sentences)
    page = (tmp_path / "out" / "reproduction.html").read_text(encoding="utf-8")
    assert "This map can create energy: the given impact map" in page


def test_help_names_the_number_of_seeds(tarsus):
    from tarsus_reproduce.robots import SEEDS

    assert f"{SEEDS} when left out" in " ".join(tarsus("reproduce", "--help").out.replace("│", " ").split())
