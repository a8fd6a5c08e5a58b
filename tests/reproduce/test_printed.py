import numpy as np
import pytest

from tarsus.base.errors import InputError
from tarsus.files.library import load_scene
from tarsus.measure.mac import mac
from tarsus.model.structure import Matrices, Modal
from tarsus_reproduce.forces import point_matrices
from tarsus_reproduce.printed import interval, modal_form, modal_structure, printed_model, rounding


def impact_shape(model) -> np.ndarray:
    """Printed change of velocity of every point per unit change of the contact foot's."""
    change = model.restitution_column - np.eye(len(model.restitution_column))[0]
    return change / change[0]


@pytest.fixture(scope="module")
def hexapod():
    return printed_model("hexapod")


@pytest.fixture(scope="module")
def spread(hexapod):
    return rounding(hexapod, draws=4000, seed=1)


def test_half_widths_follow_the_printed_digits(hexapod) -> None:
    assert hexapod.half_widths.mass == pytest.approx(np.full((6, 6), 0.005))
    damping, stiffness = hexapod.half_widths.damping, hexapod.half_widths.stiffness
    assert (damping[0, 0], damping[0, 1], damping[3, 3]) == pytest.approx((0.05, 0.5, 5.0))
    assert (stiffness[0, 0], stiffness[0, 1], stiffness[1, 1]) == pytest.approx((5e4, 5e3, 5e5))


def test_a_pair_printed_twice_is_its_mean_and_covers_both() -> None:
    quadruped = printed_model("quadruped")
    value, half = quadruped.matrices.stiffness[1, 3], quadruped.half_widths.stiffness[1, 3]
    assert value == pytest.approx(3.24e8)
    assert (value - half, value + half) == pytest.approx((3.205e8, 3.275e8))
    assert np.array_equal(quadruped.matrices.stiffness, quadruped.matrices.stiffness.T)


def test_modes_of_a_known_model() -> None:
    # Two equal masses between three equal springs: 1 and sqrt(3) times sqrt(k/m), in phase and against each other.
    mass, stiffness = 2.0 * np.eye(2), 50.0 * np.array([[2.0, -1.0], [-1.0, 2.0]])
    form = modal_form(Matrices(mass, 0.1 * stiffness, stiffness))
    assert 2.0 * np.pi * form.frequencies == pytest.approx([5.0, 5.0 * np.sqrt(3.0)])
    assert form.shapes == pytest.approx(np.array([[0.5, 0.5], [0.5, -0.5]]))
    assert form.damping_ratios == pytest.approx([0.25, 0.25 * np.sqrt(3.0)])
    assert form.coupling == pytest.approx(0.0, abs=1e-12)


def test_rounding_leaves_the_shape_of_mode_6(hexapod, spread) -> None:
    alike = np.array([mac(shapes, impact_shape(hexapod)) for shapes in spread[1].shapes])
    low, high = interval(alike)
    assert 0.951 < low[5] < 0.955
    assert 0.972 < high[5] < 0.975
    assert high[:5].max() < 0.8  # modes 3 and 4 are close and mix
    assert np.all(alike[:, 5] > alike[:, :5].max(axis=1))


def test_rounding_leaves_little_of_the_lowest_frequency(hexapod, spread) -> None:
    low, high = interval(spread[1].frequencies)
    nominal = modal_form(hexapod.matrices).frequencies
    assert np.all((low < nominal) & (nominal < high))
    assert low[0] < 60.0 and high[0] > 125.0
    assert (high[5] - low[5]) / nominal[5] == pytest.approx(0.16, abs=0.02)
    assert spread[0] == pytest.approx(0.976, abs=0.01)


def test_rounding_is_reproducible_and_vanishes_with_the_half_widths(hexapod) -> None:
    assert np.array_equal(rounding(hexapod, 50, 3)[1].frequencies, rounding(hexapod, 50, 3)[1].frequencies)
    exact = type(hexapod)(
        "exact",
        hexapod.matrices,
        Matrices(*(np.zeros((6, 6)) for _ in range(3))),
        hexapod.restitution_column,
        hexapod.table_frequencies,
    )
    share, same = rounding(exact, 5)
    form = modal_form(hexapod.matrices)
    assert share == 1.0
    assert same.frequencies == pytest.approx(np.tile(form.frequencies, (5, 1)))
    assert same.shapes == pytest.approx(np.tile(form.shapes, (5, 1, 1)))
    assert same.damping_ratios == pytest.approx(np.tile(form.damping_ratios, (5, 1)))


def test_the_hexapod_device_gives_the_printed_matrices_back(hexapod) -> None:
    structure = load_scene("hexapod").robot.structure
    assert isinstance(structure, Modal)
    unit = structure.modal_masses[0]
    back = point_matrices(structure, tuple(structure.points))
    for what in ("mass", "stiffness"):
        off = np.abs(getattr(back, what) / unit - getattr(hexapod.matrices, what))
        assert (off / getattr(hexapod.half_widths, what)).max() < 0.05, what
    total = np.ones(6) @ back.mass @ np.ones(6)
    assert total == pytest.approx(0.16e-3, rel=1e-3)


def test_hexapod_table_has_the_frequencies_of_the_table_and_the_printed_shapes(hexapod) -> None:
    printed, table = load_scene("hexapod").robot.structure, load_scene("hexapod-table").robot.structure
    assert isinstance(printed, Modal) and isinstance(table, Modal)
    assert table.frequencies == (89.5, 134.0, 314.6, 368.5, 660.0, 2910.0)
    assert table.shapes == printed.shapes
    assert table.damping_ratios == pytest.approx(printed.damping_ratios, rel=1e-6)


def test_modal_structure_and_point_matrices_are_inverse(hexapod) -> None:
    form = modal_form(hexapod.matrices)
    structure = modal_structure(form, [f"p{i}" for i in range(6)], 3.0, digits=15)
    back = point_matrices(structure, tuple(structure.points))
    assert back.mass == pytest.approx(3.0 * hexapod.matrices.mass)
    assert modal_form(back).damping_ratios == pytest.approx(form.damping_ratios)
    assert modal_form(back).coupling < 1e-9


def test_refused() -> None:
    with pytest.raises(InputError, match="no printed model is called 'hexpod'; did you mean 'hexapod'"):
        printed_model("hexpod")
    quadruped = printed_model("quadruped")
    with pytest.raises(InputError, match=r"mass matrix is not positive definite.*-1\.33"):
        modal_form(quadruped.matrices)
    with pytest.raises(InputError, match=r"none of 2000 draws .* quadruped is positive definite"):
        rounding(quadruped, 2000)
    one = Modal(frequencies=(1.0,), damping_ratios=(0.0,), modal_masses=(1.0,), shapes={"a": (1.0,), "b": (1.0,)})
    with pytest.raises(InputError, match="as many of these as the structure has coordinates, 1, got 2"):
        point_matrices(one, ("a", "b"))
