import numpy as np
import pytest

from tarsus.base.errors import InputError
from tarsus.measure.mac import mac


def test_mac_is_the_squared_cosine_of_each_pair_and_ignores_a_common_phase() -> None:
    a, b = np.array([1.0, 0.0, 0.0]), np.array([1.0, 1.0, 0.0])
    assert mac(a, b) == pytest.approx(0.5) and mac(a, -3.0 * a) == pytest.approx(1.0)
    c = np.array([1.0 + 2.0j, -0.5j, 0.3])
    assert mac(c, c * np.exp(0.7j)) == pytest.approx(1.0)
    assert mac(c, c.conj()) == pytest.approx(25.9856 / 28.5156)
    np.testing.assert_allclose(mac(np.eye(3), np.ones((3, 2))), np.full((3, 2), 1.0 / 3.0))
    assert mac(np.eye(3), np.ones(3)).shape == (3,)


@pytest.mark.parametrize(
    ("a", "b", "said"),
    [
        (np.ones(3), np.ones(4), r"same points.*\(3,\) and \(4,\)"),
        (np.zeros(3), np.ones(3), "no direction"),
        (np.ones(3), np.array([1.0, np.nan, 0.0]), "no direction"),
    ],
)
def test_mac_refuses(a: np.ndarray, b: np.ndarray, said: str) -> None:
    with pytest.raises(InputError, match=said):
        mac(a, b)
