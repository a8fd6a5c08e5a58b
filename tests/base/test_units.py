import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tarsus.base.errors import InputError
from tarsus.base.units import format_quantity, parse_quantity

UNITS = ["m", "kg", "s", "V", "N", "Hz", "N m^2 s", "N m^2/V^2", "kg/m^3", "kg/m", "N/s", "m/s^2", "rad", "1", "1/m"]


@pytest.mark.parametrize(
    ("text", "unit", "value"),
    [
        ("70 um", "m", 70e-6),
        ("70 µm", "m", 70e-6),
        ("1.747e-15 uN m^2 s", "N m^2 s", 1.747e-21),
        ("25 %", "1", 0.25),
        ("8 V", "V", 8.0),
        ("-8", "V", -8.0),
        ("58e-6", "m", 58e-6),
        ("1.7 uN/s", "N/s", 1.7e-6),
        ("2.33 g/m^3", "kg/m^3", 2.33e-3),
        ("90 deg", "rad", math.pi / 2),
        ("5 m²", "m^2", 5.0),
        ("5 mm**2", "m^2", 5e-6),
        ("3 kHz", "1/s", 3000.0),
        ("1 kΩ", "ohm", 1000.0),
        ("5 msec", "s", 5e-3),
        ("2 min", "s", 120.0),
        ("3 Microns per Second", "m/s", 3e-6),
        ("2 m s-1", "m/s", 2.0),
        ("2 m.s-2", "m/s^2", 2.0),
        ("2 N-m", "N m", 2.0),
        ("50 KHz", "Hz", 50e3),
        ("4 Millivolts", "V", 4e-3),
        ("3 deg^2", "rad^2", 3.0 * (math.pi / 180.0) ** 2),
        ("2 N/m s", "N s/m", 2.0),
    ],
)
def test_parse(text: str | float, unit: str, value: float) -> None:
    assert parse_quantity(text, unit) == value


@pytest.mark.parametrize(
    ("text", "unit", "said"),
    [
        ("3 mg", "m", "expected a length (m), got '3 mg', which is a mass"),
        ("70 um", "N m^2 s", "expected a film coefficient (N m^2 s), got '70 um', which is a length"),
        ("623 rad/s", "Hz", "expected a frequency (Hz), got '623 rad/s', which is an angular rate"),
        ("soon", "s", "expected a time (s), got 'soon', which is not a number with a unit"),
        ("nan", "m", "not a number with a unit"),
        (math.nan, "kg", "expected a mass (kg) that is finite, got nan"),
        (math.inf, "kg", "finite"),
        ("1e999 m", "m", "finite"),
        ("1e99999999999999999999 m", "m", "finite"),
        ("3 Hx", "Hz", "unknown unit 'Hx', did you mean 'Hz'?"),
        ("3 m^x", "m", "a power is a whole number"),
        ("3 mhz", "Hz", "unknown unit 'mhz'"),
        ("3 millimin", "s", "unknown unit 'millimin'"),
        (True, "m", "expected a length (m), got True"),
    ],
)
def test_refused(text: str | float, unit: str, said: str) -> None:
    with pytest.raises(InputError) as caught:
        parse_quantity(text, unit)
    assert said in str(caught.value)


@pytest.mark.parametrize(
    ("value", "unit", "text"),
    [
        (70e-6, "m", "70 um"),
        (6424.0, "Hz", "6.424 kHz"),
        (0.2, "s", "0.2 s"),
        (3.14715e-7, "N", "314.715 nN"),
        (1234.5, "V", "1.2345 kV"),
        (1.747e-21, "N m^2 s", "1.747e-21 N m^2 s"),
        (2330.0, "kg/m^3", "2330 kg/m^3"),
        (0.0, "m", "0 m"),
        (9.81, "m/s^2", "9.81 m/s^2"),
    ],
)
def test_format(value: float, unit: str, text: str) -> None:
    assert format_quantity(value, unit) == text


@given(st.floats(allow_nan=False, allow_infinity=False), st.sampled_from(UNITS))
def test_round_trip_is_exact(value: float, unit: str) -> None:
    back = parse_quantity(format_quantity(value, unit), unit)
    assert back == value
    assert math.copysign(1.0, back) == math.copysign(1.0, value)


PARTS = st.sampled_from(
    [*"0123456789.,+-eE_^*/·()²³% \u00a0\u0663kmuµnMΩ", "um", "Hz", "nan", "inf", "1e99", "**", "//"]
)


@given(st.lists(PARTS, max_size=12).map("".join), st.sampled_from(UNITS))
def test_any_text_gives_a_finite_number_or_an_input_error(text: str, unit: str) -> None:
    try:
        value = parse_quantity(text, unit)
    except InputError as error:
        assert error.problems
    else:
        assert math.isfinite(value)
