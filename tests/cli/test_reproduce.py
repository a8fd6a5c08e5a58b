"""`reproduce`: JSON, files, tables, several experiments with an index, and what is refused.

What is computed and shown is tested in tests/reproduce.
"""

from __future__ import annotations

import csv
import json
import re
import tomllib

import pytest

import tarsus as ts
from html_page import Page
from tarsus.files.toml import write_scene
from tarsus_reproduce.packaged import experiments

TABLE = "Table 3.2, row by row"
EXTRA = "gap_um,wave,volt_v,freq_hz,bounces_exp_per_s,peak_exp_um,mean_exp_um\n8,square,6,40,100,20,\n"


@pytest.mark.slow
def test_rows_are_printed_and_in_files(tarsus, opened, tmp_path):
    """Of the hexapod's ensemble with one more row."""
    extra, folder = tmp_path / "rows.csv", tmp_path / "out"
    extra.write_text(EXTRA, encoding="utf-8")
    result = tarsus("reproduce", "hexapod", "--rows", extra, "--seeds", "2", "--json", "-o", folder).json()
    assert (result["experiment"], result["ok"]) == ("hexapod", True)
    rows = result[TABLE]
    assert [row["role"] for row in rows[::4]] == ["calibrated on"] * 2 + ["predicted"] * 2
    for row in rows:
        low, high = row["80 % interval"]
        assert row["unit"] == "%" or row["this model"] is None or 0.0 <= low <= row["this model"] <= high
        assert row["unit"] != "%" or 0.0 <= row["this model"] <= 1.0
    _, peak, mean, _ = rows[12:]
    assert peak["case"].startswith("40 Hz") and mean["measured"] is None
    assert peak["our error"] == pytest.approx((20e-6 - peak["this model"]) / 20e-6)
    modes = result["Modes and the printed CoR column"][:-1]
    assert max(modes, key=lambda mode: mode["MAC"])["mode"] == "6"
    energies = {row["energy made by"]: row for title in result if " impacts at " in title for row in result[title]}
    assert energies["mass-weighted, as it is"]["impacts that make energy"] == 0.0
    assert energies["printed, as it is"]["most made"] > 0.0
    assert json.loads((folder / "reproduction.json").read_text(encoding="utf-8")) == result
    with (folder / "reproduction.csv").open(encoding="utf-8", newline="") as stream:
        stored = list(csv.DictReader(stream))
    assert [row["role"] for row in stored] == [row["role"] for row in rows]
    assert float([row for row in stored if row["quantity"] == "peak height"][3]["this model"]) == peak["this model"]
    assert [row["measured"] for row in stored if row["quantity"] == "mean height"][3] == ""
    assert opened(folder, "reproduction", "hexapod", "reproduction.html")[TABLE] == rows


def test_tables_for_people(tarsus):
    result = tarsus("reproduce", "cantilever-1", "-q")
    assert result.code == 0 and not result.err and " nan" not in result.out
    assert all(words in result.out for words in ("Table 2.3", "Table A.1, row by row", "80 % interval", "our error"))
    assert all(len(line) <= 125 for line in result.out.splitlines())


@pytest.mark.slow  # all experiments on all rows
def test_every_experiment_has_a_folder_and_a_place_in_the_index(tarsus, tmp_path):
    found = tarsus("reproduce", "--all", "-o", tmp_path, "--seeds", "2", "--json").json()["experiments"]
    text = (tmp_path / "index.html").read_text(encoding="utf-8")
    assert list(found) == list(experiments())
    assert re.findall(r'href="([^"#]+)"', text) == [f"{name}/reproduction.html" for name in found]
    assert all(one.title in Page(text).text for one in experiments().values())
    for name, one in found.items():
        assert json.loads((tmp_path / name / "reproduction.json").read_text(encoding="utf-8")) == one
        assert (tmp_path / name / "reproduction.html").stat().st_size > 10_000


def test_a_millipede_without_a_law_that_varies_is_refused(tarsus, tmp_path):
    without = {"ground.film": None, "ground.restitution": None, "provenance": {}}
    write_scene(ts.with_values(ts.load_scene("millipede"), without), tmp_path / "bare.toml")
    result = tarsus("reproduce", "millipede", "--device", tmp_path / "bare.toml")
    assert result.code == 2
    assert len(result.sentences) == 9  # five studies vary the restitution, two the film, the grounds of Fig. 4.7 both
    assert any("ground.film.coefficient" in sentence for sentence in result.sentences)


@pytest.mark.parametrize(
    ("spoil", "said"),
    [
        (lambda table: table["robot"].pop("feet"), "no foot"),
        (lambda table: table.pop("signals"), "no drive signal"),
        (lambda table: table["signals"].update(pzt={"kind": "constant", "level": "3 V"}), "does not repeat"),
    ],
)
def test_a_device_that_cannot_bounce_is_refused(tarsus, save, tmp_path, spoil, said):
    write_scene(ts.load_scene("hexapod"), tmp_path / "whole.toml")
    table = tomllib.loads((tmp_path / "whole.toml").read_text(encoding="utf-8"))
    table.pop("provenance")
    spoil(table)
    result = tarsus("reproduce", "hexapod", "--device", save(table))
    assert (result.code, result.out) == (2, "")
    (sentence,) = result.sentences
    assert said in sentence


@pytest.mark.slow  # a run that diverges
def test_a_map_that_creates_energy_is_announced_and_its_divergence_ends_with_1(tarsus, save, tmp_path):
    from tarsus_reproduce.impacts import printed_column

    write_scene(ts.load_scene("hexapod"), tmp_path / "whole.toml")
    hexapod = tomllib.loads((tmp_path / "whole.toml").read_text(encoding="utf-8"))
    hexapod.pop("provenance")
    points = hexapod["robot"]["structure"]["shapes"]
    column = dict(zip(points, printed_column("hexapod").tolist(), strict=True))
    hexapod["ground"]["impact"] = {"kind": "given", "columns": {"foot1": column}, "passive": False}
    hexapod["robot"]["structure"]["damping_ratios"] = [0.002] * 6  # so little that the energy made stays
    hexapod["robot"]["drives"]["pzt"]["law"]["gain"] = "2.3 uN/V"
    hexapod["signals"]["pzt"] |= {"amplitude": "10 V", "offset": "0 V", "frequency": "85 Hz"}
    result = tarsus("reproduce", "hexapod", "--device", save(hexapod), "--seeds", "1", "-o", tmp_path / "out")
    assert result.code == 1 and "can create energy" in result.out
    assert all("The run stopped" in one or "of the runs ended early" in one for one in result.sentences)
    page = (tmp_path / "out" / "reproduction.html").read_text(encoding="utf-8")
    assert "can create energy" in page
