"""Poles of frequency responses by poly-reference least squares in the z domain, and those that many orders agree on."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from tarsus.base.arrays import Complexes, Floats

_BANDWIDTHS_APART = 0.5
"""Half-power bands within which poles of two orders are one track: closer modes are not distinguished."""
_LINES_APART = 0.5
"""The same in lines, for poles that are sharper than the lines are apart."""
_ORDERS_MISSED = 2
"""Orders that a track may skip."""


def fit_poles(frequency: Floats, values: Complexes, orders: Sequence[int]) -> dict[int, Complexes]:
    """Poles [rad/s] of a right matrix-fraction model for every order (Guillaume et al., IMAC 2003).

    The band is mapped onto the whole unit circle, with complex coefficients. The powers of z are then orthogonal on
    the lines and the normal equations are Toeplitz matrices of the transforms of H and abs(H)^2, so that high orders
    stay well conditioned, and a band that does not begin at 0 Hz has no mirrored poles. The lowest coefficient is held
    at one, which pushes the poles of noise towards growing motion.

    Parameters
    ----------
    frequency
        Evenly spaced lines (nf,) [Hz].
    values
        Responses (no, ni, nf), in any unit; each is scaled to unit mean square first.
    orders
        Orders of the denominator; order n gives n ni poles.
    """
    top, inputs = max(orders), values.shape[1]
    power = np.mean(np.abs(values) ** 2, axis=-1, keepdims=True)
    scaled = values / np.sqrt(np.where(power > 0.0, power, 1.0))
    shift = np.arange(top + 1)[None, :] - np.arange(top + 1)[:, None]
    response = np.fft.ifft(scaled, axis=-1)[..., shift]
    square = np.fft.ifft(np.einsum("oif,ojf->ijf", scaled.conj(), scaled), axis=-1)[..., shift]
    span = (frequency[1] - frequency[0]) * len(frequency)
    poles = {}
    for order in orders:
        size = order + 1
        part = response[..., :size, :size].transpose(0, 2, 1, 3).reshape(-1, inputs * size)
        both = (part.conj().T @ part).reshape(inputs, size, inputs, size)
        normal = square[..., :size, :size] - both.transpose(0, 2, 1, 3)
        matrix = normal.transpose(2, 0, 3, 1).reshape(size * inputs, size * inputs)
        tail = np.linalg.lstsq(matrix[inputs:, inputs:], -matrix[inputs:, :inputs], rcond=None)[0]
        companion = np.eye(order * inputs, k=-inputs, dtype=complex)
        companion[:inputs] = -tail.reshape(order, inputs, inputs).transpose(1, 0, 2).reshape(inputs, -1)
        inverse = np.linalg.eigvals(companion)
        inverse = inverse[np.abs(inverse) > 0.0]
        turn = np.mod(-np.angle(inverse), 2.0 * np.pi)
        poles[order] = 2.0j * np.pi * frequency[0] + span * (1.0j * turn - np.log(np.abs(inverse)))
    return poles


def pole_tracks(poles: Mapping[int, Complexes], line: float) -> list[tuple[complex, int]]:
    """Poles [rad/s] that stay where they are from order to order, and how many orders have them, most first.

    A pole is the median of real and imaginary part over the upper half of the orders that have it.

    A pole follows a chain when it moved by less than half a half-power bandwidth, or half the line spacing
    where that is more; a chain may miss two orders in a row.

    Parameters
    ----------
    poles
        Poles [rad/s] by order.
    line
        Spacing of the lines [Hz].
    """
    growing: list[list[tuple[int, complex]]] = []
    done: list[list[tuple[int, complex]]] = []
    ordered = sorted(poles)
    for place, order in enumerate(ordered):
        late = ordered[max(0, place - 1 - _ORDERS_MISSED)]
        done += [chain for chain in growing if chain[-1][0] < late]
        growing = [chain for chain in growing if chain[-1][0] >= late]
        here = poles[order]
        ends = np.array([chain[-1][1] for chain in growing], dtype=complex)
        reach = np.maximum(2.0 * _BANDWIDTHS_APART * np.abs(ends.real), 2.0 * np.pi * _LINES_APART * line)
        apart = np.abs(here[:, None] - ends[None, :]) / reach if len(ends) else np.zeros((len(here), 0))
        free = set(range(len(here)))
        taken: set[int] = set()
        for flat in np.argsort(apart, axis=None):
            i, j = divmod(int(flat), apart.shape[1])
            if apart[i, j] > 1.0:
                break
            if i in free and j not in taken:
                growing[j].append((order, complex(here[i])))
                free.discard(i)
                taken.add(j)
        growing += [[(order, complex(here[i]))] for i in sorted(free)]
    found = []
    for chain in sorted(done + growing, key=len, reverse=True):
        upper: Complexes = np.array([pole for _, pole in chain[len(chain) // 2 :]])
        found.append((complex(np.median(upper.real), np.median(upper.imag)), len(chain)))
    return found
