"""Linear algebra of small matrices with a fixed order of operations, against numpy."""

import numpy as np
import pytest

from tarsus.base.linear import (
    cholesky,
    condition_of,
    eig,
    eigh,
    inverse,
    largest_of,
    length,
    modes_of,
    product,
    pseudoinverse,
    rank_of,
    solve,
    svd,
)

SIZES = (1, 2, 3, 5, 12, 33)


def random(n, m=None, seed=0):
    return np.random.default_rng([seed, n, m or n]).normal(size=(n, m or n))


@pytest.mark.parametrize("n", SIZES)
def test_symmetric_eigenvalues_and_vectors(n):
    a = product(random(n), random(n).T)
    values, vectors = eigh(a)
    np.testing.assert_allclose(values, np.linalg.eigvalsh(a), rtol=1e-12, atol=1e-13 * n)
    np.testing.assert_allclose(a @ vectors, vectors * values, atol=1e-13 * n * values[-1])
    np.testing.assert_allclose(vectors.T @ vectors, np.eye(n), atol=1e-14 * n)


def test_small_eigenvalues_of_a_stiff_structure_keep_their_digits():
    """Two masses on springs 1e12 apart: the soft eigenvalue is exact to its own rounding, which LAPACK loses."""
    scale = np.array([1e6, 1.0])
    a = np.array([[2.0, 0.5], [0.5, 3.0]]) * scale[:, None] * scale
    soft = eigh(a)[0][0]
    assert soft == pytest.approx((3.0 - 0.25 / 2.0) * (1.0 - 1e-12 * 0.0625), rel=1e-12)


@pytest.mark.parametrize("n", SIZES)
@pytest.mark.parametrize("m", (1, 4, 40))
def test_singular_values_and_what_a_matrix_does_not_see(n, m):
    a = random(m, n)
    sizes, vectors = svd(a)
    known = np.linalg.svd(a)[1]
    np.testing.assert_allclose(sizes[: len(known)], known, rtol=1e-12)
    assert np.abs(sizes[len(known) :]).max(initial=0.0) < 1e-14 * known[0]
    np.testing.assert_allclose(vectors.T @ vectors, np.eye(n), atol=1e-13)
    assert np.abs(a @ vectors[:, min(m, n) :]).max(initial=0.0) < 1e-13 * known[0]
    np.testing.assert_allclose(pseudoinverse(a), np.linalg.pinv(a), atol=1e-12 * np.abs(np.linalg.pinv(a)).max())
    assert rank_of(a) == min(m, n)


@pytest.mark.parametrize("n", SIZES)
def test_eigenvalues_of_any_matrix_come_in_conjugate_pairs(n):
    a = random(n) * 10.0 ** np.random.default_rng(n).uniform(-3, 3, n)
    values, vectors = eig(a)
    np.testing.assert_allclose(a @ vectors, vectors * values, atol=1e-11 * np.abs(a).max())
    assert sorted(values, key=lambda v: (v.real, v.imag)) == sorted(values.conj(), key=lambda v: (v.real, v.imag))
    for value in np.linalg.eigvals(a):
        assert np.abs(values - value).min() < 1e-9 * np.abs(values).max()


def test_a_rigid_motion_is_one_direction_with_a_double_zero():
    values, vectors = eig(np.array([[0.0, 1.0], [0.0, 0.0]]))
    assert values.tolist() == [0.0, 0.0]
    np.testing.assert_allclose(np.abs(vectors[0]), 1.0)


@pytest.mark.parametrize("n", SIZES)
def test_equations_and_factors(n):
    a, b = random(n), random(n, 3, seed=1)
    np.testing.assert_allclose(a @ solve(a, b), b, atol=1e-11)
    np.testing.assert_allclose(
        solve(a + 1j * b[:, :1], b[:, 0]), np.linalg.solve(a + 1j * b[:, :1], b[:, 0]), rtol=1e-8
    )
    np.testing.assert_allclose(inverse(a) @ a, np.eye(n), atol=1e-11)
    mass = a @ a.T + np.eye(n)
    np.testing.assert_allclose(cholesky(mass) @ cholesky(mass).T, mass, rtol=1e-12, atol=1e-12)
    squared, shapes = modes_of(mass, b @ b.T)
    np.testing.assert_allclose(shapes.T @ mass @ shapes, np.eye(n), atol=1e-12)
    np.testing.assert_allclose(shapes.T @ (b @ b.T) @ shapes, np.diag(squared), atol=1e-12 * max(squared[-1], 1.0))
    assert condition_of(mass) == pytest.approx(np.linalg.cond(mass), rel=1e-10)
    assert largest_of(mass) == pytest.approx(np.linalg.eigvalsh(mass)[-1], rel=0.05)
    np.testing.assert_allclose(product(a, b), a @ b, atol=1e-13)
    np.testing.assert_allclose(length(b), np.linalg.norm(b, axis=0))


def test_a_singular_matrix_is_refused():
    with pytest.raises(np.linalg.LinAlgError):
        solve(np.ones((2, 2)), np.ones(2))
    with pytest.raises(np.linalg.LinAlgError):
        cholesky(np.array([[1.0, 2.0], [2.0, 1.0]]))
    assert largest_of(np.zeros((3, 3))) == 0.0
