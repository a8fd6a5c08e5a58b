"""Rows files of the printed tables: what is read; faults of single cells are those of `tarsus.files.rows`."""

from __future__ import annotations

import pytest

from tarsus.base.errors import InputError
from tarsus_reproduce.rows import CANTILEVER, HEIGHTS, packaged_rows, parse_rows, read_rows, relative_error


def parse(text: str, table=CANTILEVER):
    return parse_rows(text, table, where="rows.csv", origin="rows.csv")


def test_packaged_tables_have_the_published_rows():
    rows = packaged_rows(CANTILEVER)
    assert len(rows) == 12
    first = rows[0]
    assert (first.freq_hz, first.volt_v, first.wave, first.gap_um, first.origin) == (5, 6, "square", None, "packaged")
    assert first.source == {"bounces": 2.0, "peak_um": 211.0, "contact_ms": 97.0}
    assert first.measured == {"bounces": 3.0, "peak_um": 186.0, "contact_ms": 98.0}
    sine, square, third = packaged_rows(HEIGHTS)
    assert (sine.wave, sine.volt_v, sine.gap_um, sine.freq_hz) == ("sine", 10.0, 10.0, None)
    assert sine.measured["bounces_per_s"] == 260.0 and sine.source["mean_um"] == 17.3
    assert (square.measured["peak_um"], square.source["peak_um"]) == (36.2, 28.5)
    assert (third.wave, third.gap_um, third.measured, third.source) == ("square", 5.0, None, None)


def test_comments_fractions_and_empty_cells():
    one, other = parse(
        f"# a comment\n\n{','.join(CANTILEVER.columns)}\n"
        "  # another\n100,8,Square,1,1.5,264,194,4.2,\n50,8,sine,,1~2,,,,\n"
    )
    assert one.wave == "square" and one.measured == {"bounces": 1.5, "peak_um": 194.0, "contact_ms": None}
    assert other.measured["bounces"] == 1.5 and other.source is None


def test_columns_in_any_order_and_rows_without_names():
    (row,) = parse("wave,peak_exp_um,volt_v,freq_hz\nsine,150,8,15\n")
    assert (row.freq_hz, row.volt_v, row.wave) == (15.0, 8.0, "sine")
    assert row.measured == {"bounces": None, "peak_um": 150.0, "contact_ms": None} and row.source is None
    short, whole = parse("15,8,sine\n50,8,square,1,1,264,200,9.2,9\n")
    assert short.measured is None
    assert whole.source == {"bounces": 1.0, "peak_um": 264.0, "contact_ms": 9.2}
    one, other = parse("# mine\nsquare,10,5,111,22.5,13\n\nsine,5,8,,,\n", HEIGHTS)
    assert one.measured == {"bounces_per_s": 111.0, "peak_um": 22.5, "mean_um": 13.0} and other.measured is None
    assert parse("gap_um,wave,volt_v,freq_hz\n5,sine,10,40\n", HEIGHTS)[0].freq_hz == 40.0


def test_semicolons_come_with_decimal_commas():
    """As a spreadsheet writes them where decimals have a comma."""
    (row,) = parse("freq_hz;volt_v;wave;bounces_exp;peak_exp_um\n15;7,5;sine;1;150,25\n")
    assert (row.volt_v, row.measured) == (7.5, {"bounces": 1.0, "peak_um": 150.25, "contact_ms": None})


def test_a_quoted_comma_that_may_be_one_of_thousands_is_refused():
    with pytest.raises(InputError, match="line 2: '1,208' has a decimal comma or one of thousands; write it without"):
        parse('freq_hz,volt_v,wave,peak_exp_um\n"15,5","7,25",sine,"1,208"\n')


def test_files_keep_their_name_and_every_bad_row_is_named(tmp_path):
    file = tmp_path / "mine.csv"
    file.write_bytes(b"\xef\xbb\xbffreq_hz,volt_v,wave\r\n5,6,sine\r\n")
    assert read_rows(file, CANTILEVER)[0].origin == "mine.csv"
    with pytest.raises(InputError) as caught:
        parse("freq_hz,volt_v,wave\nx,6,sine\n5,6,sine\n5,y,saw\n")
    assert [one.split(":")[0] for one in caught.value.problems] == [f"rows.csv, line {n}" for n in (2, 4, 4)]


def test_zero_against_zero_is_no_error_and_something_against_zero_has_none():
    assert relative_error(0.0, 0.0) == 0.0
    assert relative_error(0.0, 2.0) is relative_error(None, 2.0) is relative_error(2.0, float("nan")) is None
    assert relative_error(4.0, 5.0) == -0.25
