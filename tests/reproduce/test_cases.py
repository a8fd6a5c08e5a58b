"""Rows files: what is read, and what is said about bad ones."""

from __future__ import annotations

import pytest

from tarsus.base.errors import InputError
from tarsus_reproduce.cases import COLUMNS, Observation, packaged_cases, parse_cases, read_cases


def parse(text: str):
    return parse_cases(text, where="rows.csv", origin="rows.csv")


def problems(text: str) -> list[str]:
    with pytest.raises(InputError) as caught:
        parse(text)
    return caught.value.problems


def test_packaged_table_has_the_twelve_published_rows():
    cases = packaged_cases()
    assert len(cases) == 12
    first = cases[0]
    assert (first.freq_hz, first.volt_v, first.wave, first.origin) == (5.0, 6.0, "square", "packaged")
    assert first.source == Observation(2.0, 211.0, 97.0)
    assert first.measured == Observation(3.0, 186.0, 98.0)


def test_comments_blank_lines_fractions_and_empty_cells():
    cases = parse(
        f"# a comment\n\n{','.join(COLUMNS)}\n"
        "  # another\n100,8,Square,1,1.5,264,194,4.2,\n50,8,sine,,1~2,,,,\n"
    )
    assert cases[0].wave == "square"
    assert cases[0].measured == Observation(1.5, 194.0, None)
    assert cases[1].measured.bounces == 1.5
    assert not cases[1].source


def test_result_columns_may_be_missing_and_columns_may_be_in_any_order():
    (case,) = parse("wave,peak_exp_um,volt_v,freq_hz\nsine,150,8,15\n")
    assert (case.freq_hz, case.volt_v, case.wave) == (15.0, 8.0, "sine")
    assert case.measured == Observation(None, 150.0, None)
    assert not case.source


def test_rows_without_a_line_of_names_have_the_packaged_order():
    short, whole = parse("15,8,sine\n50,8,square,1,1,264,200,9.2,9\n")
    assert not short.measured
    assert whole.source == Observation(1.0, 264.0, 9.2)


def test_a_byte_order_mark_is_no_part_of_the_first_name(tmp_path):
    file = tmp_path / "rows.csv"
    file.write_bytes(b"\xef\xbb\xbffreq_hz,volt_v,wave\r\n5,6,sine\r\n")
    assert read_cases(file)[0].wave == "sine"


@pytest.mark.parametrize(
    ("line", "said"),
    [
        ("fast,6,square", "line 2: 'freq_hz' should be a number, got 'fast'"),
        ("0,6,square", "line 2: 'freq_hz' must be a number above zero"),
        ("5,-6,square", "line 2: 'volt_v' must be a number above zero"),
        ("nan,6,square", "line 2: 'freq_hz' must be a number above zero"),
        ("5,,square", "line 2: 'volt_v' is empty"),
        ("5,6,squre", "line 2: 'wave' must be square or sine, got 'squre'; did you mean 'square'?"),
        ("5,6", "line 2: 'wave' must be square or sine"),
        ("5,6,square,1,1,200,-3", "line 2: 'peak_exp_um' must be zero or more"),
        ("5,6,square,1,1,200,inf", "line 2: 'peak_exp_um' must be zero or more"),
        ("5,6,square,1,1,2,3,4,5,6", "line 2: 10 cells, but there are 9 columns"),
        ("5,6,square,1~2~3", "line 2: 'bounces_sim' should be a number"),
    ],
)
def test_a_bad_row_is_a_sentence_with_its_line(line, said):
    (only,) = problems(f"50,8,sine\n{line}\n")
    assert only.startswith("rows.csv, ")
    assert said in only


def test_all_bad_rows_are_named_at_once():
    said = problems("freq_hz,volt_v,wave\nx,6,sine\n5,6,sine\n5,y,sine\n")
    assert [one.split(":")[0] for one in said] == ["rows.csv, line 2", "rows.csv, line 4"]


def test_bad_column_names():
    said = problems("freq_hz,volts_v,wave,wave\n5,6,sine,sine\n")
    assert any("unknown column 'volts_v'; did you mean 'volt_v'?" in one for one in said)
    assert any("'wave' appears twice" in one for one in said)
    assert any("'volt_v' is missing" in one for one in said)


@pytest.mark.parametrize("text", ["", "# nothing\n\n", "freq_hz,volt_v,wave\n"])
def test_no_rows_is_an_error(text):
    assert "no rows" in problems(text)[0]


def test_missing_and_unreadable_files(tmp_path):
    with pytest.raises(InputError, match="cannot read the rows file"):
        read_cases(tmp_path / "none.csv")
    binary = tmp_path / "binary.csv"
    binary.write_bytes(b"\xff\xfe\x00\x01")
    with pytest.raises(InputError, match="not text"):
        read_cases(binary)
