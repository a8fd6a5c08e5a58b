"""Tables: their four forms, and how numbers are written."""

import csv
import io
import json
import math
import subprocess
import sys

import pytest
from markupsafe import Markup

from tarsus.tables import Column, Table, amount, interval, number, percent
from tarsus.tables.data import data_tables
from tarsus.tables.numbers import amounts, digits_apart, path_end


@pytest.fixture(scope="module")
def table() -> Table:
    columns = ("path", Column("value", "row"), Column("error", "%", 2), Column("range", "row", 3, over="95 %"), "held")
    rows = [("robot.mass", 2.641e-4, 0.0941, (1e-6, 3.4e-5), True), ("b <c>\nall 30", float("nan"), None, None, False)]
    part = Table("Part", ("n", Column("of", note="those that count")), [(1, 2)])
    return Table("A title", columns, rows, ["A note."], [part], units=("m", "1"), flagged=[(0, 3)])


def test_text(table):
    lines = table.text().splitlines()
    assert lines[0] == "A title" and lines[1].split() == ["path", "value", "error", "95", "%:", "range", "held"]
    assert lines[3].split("  ")[0] == "robot.mass" and "264.1 µm" in lines[3] and "1 to 34 µm !" in lines[3]
    assert lines[4].startswith("b <c> (all 30)") and lines[4].count("–") == 3 and lines[4].endswith("no")
    assert lines[5:8] == ["A note.", "", "Part"] and lines[-1] == "of: those that count"
    assert str(table) == table.text() and all(line == line.rstrip() for line in lines)


def test_tables_fit_their_width():
    """Texts give way, words are folded where that is not enough, and what a no-break space joins stays whole."""
    path, value = "robot.structure.legs.L1.stiffness_v", "-744.7\N{NO-BREAK SPACE}nN/V, 3\N{NO-BREAK SPACE}V"
    rows = [(path, value, "A sentence of some length. " * 6, 1234.5)]
    for width in (60, 80, 120):
        lines = Table("", ("path", "value", "why", "n"), rows, ["A note that is much longer than a line. " * 4]).text(
            width
        )
        assert max(map(len, lines.splitlines())) <= width and "1234" in lines
        assert any("-744.7 nN/V," in line for line in lines.splitlines())


@pytest.mark.parametrize(
    ("values", "digits"),
    [
        ([61.13107616e-6, 60e-6], 4),
        ([61.13107616e-6, 61.1312e-6], 6),
        ([61.13107616e-6, 61.13107617e-6], 7),
        ([2.0, 2.0, math.nan], 4),
        ([], 4),
    ],
)
def test_digits_are_as_many_as_tell_numbers_apart(values, digits):
    assert digits_apart(values) == digits


def test_html_is_escaped_and_holds_everything(table):
    page = table.html()
    assert page == table._repr_html_() and page.count("<tr>") == 3 + 2  # heads, rows and those of the part
    assert "b &lt;c&gt;<small>all 30</small>" in page and "<code>robot.<wbr>mass</code>" in page
    assert 'class="n off">1 to 34 µm<' in page and '<th colspan="1" scope="colgroup">95 %</th>' in page
    assert "A note." in page and "<caption>Part</caption>" in page


def test_html_of_texts_that_are_html():
    markup = Markup("<b>x</b>")
    one = Table("", ("a",), [(markup,)])
    assert "<b>x</b>" in one.html() and one.text().splitlines()[-1] == "x" and one.json()["rows"] == [["x"]]


def test_three_columns_of_long_words_are_cards_on_a_narrow_screen():
    long = Table(
        "", ("open", "why", "record"), [("film.coefficient,", "capture_unless_pulled is used", "displacement of mid")]
    )
    short = Table("", ("", "before", "after"), [("hardest touchdown", "188.1 mm/s", "421.6 um/s")])
    assert 'class="table cards"' in long.html() and 'class="table"' in short.html()


def test_csv_and_plain_data_are_in_si(table):
    head, first, second = csv.reader(io.StringIO(table.csv()))
    assert head == ["path", "value", "error", "95 % range from", "95 % range to", "held", "unit"]
    assert first == ["robot.mass", "0.0002641", "0.0941", "1e-06", "3.4e-05", "true", "m"]
    assert second[1:5] == ["", "", "", ""]
    data = json.loads(json.dumps(table.json()))
    assert data["rows"][0] == ["robot.mass", 2.641e-4, 0.0941, [1e-6, 3.4e-5], True, "m"]
    assert data["rows"][1][1] is None and data["parts"][0]["rows"] == [[1, 2]]
    assert data["columns"][2] == {"name": "error", "unit": "1"}, "percent is how it is shown"
    assert Table("", (Column("a", "m"),), [(1.0,)]).csv() == "a [m]\n1.0\n"


@pytest.mark.parametrize("rows, units", [([(1,)], ()), ([(1, 2)], ("m", "s"))])
def test_rows_that_do_not_fit_are_refused(rows, units):
    with pytest.raises(ValueError):
        Table("", ("a", "b"), rows, units=units)


AMOUNTS = [
    (264.1e-6, "m", "264.1 µm"),
    (0.0, "s", "0 s"),
    (-0.6499e-6, "N", "−649.9 nN"),
    (3.14159, "1", "3.142"),
    (123456.0, "1", "1.235·10⁵"),
    (float("nan"), "m", "–"),
    (1.747e-21, "N m^2 s", "1.747·10⁻²¹ N m² s"),
    (999.96e-6, "s", "1 ms"),
    (2.5e-12, "kg m^2", "2.5 ng m²"),
    (1e-6, "kg", "1 mg"),
    (12.5, "um", "12.5 µm"),
    (0.0941, "%", "9.41 %"),
    (None, "V", "–"),
]


@pytest.mark.parametrize("value, unit, text", AMOUNTS)
def test_amounts(value, unit, text):
    assert amount(value, unit) == text


def test_numbers_percents_and_intervals():
    assert (
        number(None) == number(float("inf")) == "–" and number(1234567.0) == "1.235·10⁶" and number(12345.6) == "12350"
    )
    assert percent(1.0, 2) == "100 %" and percent(None) == "–"
    assert amounts((0.0, -8.509e-9, -1.829e-7), "N/V") == "0, −8.509, −182.9 nN/V"
    assert interval(1e-6, 3.4e-5, "m", 3) == "1 to 34 µm" and interval(0.1, 0.25, "%") == "10 to 25 %"
    assert (
        interval(1.0, 2.0) == "1 to 2" and interval(None, None, "m") == "–" and interval(None, 2.0, "s") == "– to 2 s"
    )


def test_a_column_of_one_unit_says_it_once_and_every_other_row_keeps_its_flags():
    one = Table("", (Column("share", "%", shared=True),), [(0.25,), (0.5,), (1.0,)], flagged=[(1, 0), (2, 0)])
    assert (one.heads(), one.cells()) == (["share (%)"], [["25"], ["50"], ["100"]])
    assert one.bare(2).rows == ((0.25,), (1.0,)) and one.bare(2).flagged == {(1, 0)}
    assert path_end("robot.structure.frequencies.0") == "structure.frequencies.0"


def test_the_package_is_imported_without_what_shows_tables():
    heavy = "{'rich', 'jinja2', 'markupsafe'} & set(sys.modules)"
    told = f"import sys, tarsus; from tarsus.tables import Table; Table('', ('a',), [(1,)]); assert not {heavy}"
    subprocess.run([sys.executable, "-c", told], check=True)


def test_plain_data_become_tables():
    """Numbers by name, alike entries as rows, nested ones below their names; no long lists of numbers."""
    fitted = {"a": {"value": 2e-6, "interval": [1e-6, 3e-6]}, "b": {"value": 5.0, "interval": [4.0, 6.0]}}
    rows = [{"row": i, "wave": {"volts": i, "kinds": {"x": 1}}} for i in range(25)]
    steps = {"film": {"used": ["2 of 2 files"], "parameters": fitted}}
    data = {"name": "it", "lasts_s": 2e-3, "steps": steps, "rows": rows, "curve": list(range(50)), "none": {}}
    head, used, parameters, listed = data_tables(data)
    assert head.rows == (("name", "it"), ("lasts s", 2e-3)) and "2 ms" in head.text()
    assert used.rows == (("film", "2 of 2 files"),)
    assert [one.name for one in parameters.columns] == ["film parameters", "value", "interval"]
    assert parameters.rows[0] == ("a", 2e-6, (1e-6, 3e-6))
    assert [one.name for one in listed.columns] == ["rows", "row", "wave volts"]
    assert len(listed.rows) == 20 and listed.notes == ("5 more rows",)
    assert [table.rows for table in data_tables(data, ("lasts_s",))] == [(("lasts s", 2e-3),)]
