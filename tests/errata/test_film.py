"""E2 to E4: sign, gap and unit of the film law (2.10) and Table 2.2 of the source."""

from __future__ import annotations

import pytest

from tarsus.base.units import parse_quantity
from tarsus.model.laws import Film

GAP_AT_REST, PRINTED_GAP = 70e-6, 58e-6  # d_p and g_p of Table 2.2 [m]


def force(film: Film, gap: float, gap_rate: float) -> float:
    """Film force [N] by a central difference of the law's momentum."""
    step = 1e-4 * (gap + film.thickness)
    slope = (film.momentum(gap + step, *film.parameters()) - film.momentum(gap - step, *film.parameters())) / (2 * step)
    return slope * gap_rate


def test_e2_the_film_opposes_the_motion_both_ways():
    film = Film(coefficient="1.747e-15 uN m^2 s", thickness="58 um")
    for gap in (0.0, 1e-6, 70e-6):
        assert force(film, gap, -0.1) > 0.0
        assert force(film, gap, +0.1) < 0.0
        expected = -film.coefficient * 0.1 / (gap + film.thickness) ** 3
        assert force(film, gap, 0.1) == pytest.approx(expected, rel=1e-6)


def test_e3_as_printed_the_film_is_singular_before_contact():
    # x_p counts from rest, contact is at x_p = -d_p; the printed law divides by (x_p + g_p)^3.
    travel_to_singularity, travel_to_contact = PRINTED_GAP, GAP_AT_REST
    assert travel_to_contact - travel_to_singularity == pytest.approx(12e-6)
    # As we read it, g_p is what is left at contact, and the force there is finite.
    film = Film(coefficient="1.747e-15 uN m^2 s", thickness="58 um")
    assert abs(force(film, 0.0, -1.0)) == pytest.approx(1.747e-21 / 58e-6**3, rel=1e-6)


def test_e3_without_a_residual_thickness_the_film_is_refused():
    from tarsus.base.errors import InputError

    with pytest.raises(InputError, match="thickness"):
        Film(coefficient="1.747e-15 uN m^2 s", thickness=0.0)


def test_e4_only_micronewtons_agree_with_plate_theory():
    viscosity, length, width = 1.8e-5, 150e-6, 100e-6  # air [Pa s], the tip [m]
    plate_theory = 0.5 * viscosity * length * width**3
    assert plate_theory == pytest.approx(1.3e-21, rel=0.05)
    as_read = parse_quantity("1.747e-15 uN m^2 s", "N m^2 s")
    as_printed = parse_quantity("1.747e-15 nN m^2 s", "N m^2 s")
    assert as_read == pytest.approx(1.747e-21, rel=1e-12)
    assert 0.5 < plate_theory / as_read < 2.0
    assert plate_theory / as_printed > 500.0
