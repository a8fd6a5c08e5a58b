"""Exact linear flow: nodal outputs, end state and the Taylor polynomial of a step (compiled, no physics)."""

from __future__ import annotations

from tarsus.core.jit import fused, inner
from tarsus.core.nodes import N
from tarsus.core.row import load, store

TERMS = 40  # most Taylor terms kept for landing inside a step


@fused
def outputs_from_state(node_state, q, k, o, size, w, out):
    """out[o, :] = outputs at the nodes caused by the state w."""
    sum_ = load(node_state, (q, k, o, 0)) * w[0]
    for r in range(1, size):
        sum_ += load(node_state, (q, k, o, r)) * w[r]
    store(out, (o,), sum_)


@fused
def add_constant(node_constant, q, k, o, i, value, out):
    store(out, (o,), load(out, (o,)) + load(node_constant, (q, k, o, i)) * value)


@fused
def nodal(node_input, q, k, o, i, values):
    """Output o at the nodes caused by the input row values[i, :]."""
    even = load(node_input, (q, k, o, i, 0)) * values[i, 0]
    odd = load(node_input, (q, k, o, i, 1)) * values[i, 1]
    for a in range(2, N, 2):
        even += load(node_input, (q, k, o, i, a)) * values[i, a]
        odd += load(node_input, (q, k, o, i, a + 1)) * values[i, a + 1]
    return even + odd


@fused
def add_nodal(node_input, q, k, o, i, values, out):
    """out[o, :] += effect of the input row values[i, :]."""
    store(out, (o,), load(out, (o,)) + nodal(node_input, q, k, o, i, values))


@fused
def flow_state(exponential, state_constant, state_input, q, k, nb, ni, w, values, constant, active, out):
    """out = state at the end of the whole step: exp(T h) w and what the inputs add."""
    for b in range(nb):
        x = w[b]
        y = w[nb + b]
        out[b] = exponential[q, k, 0, b] * x + exponential[q, k, 1, b] * y
        out[nb + b] = exponential[q, k, 2, b] * x + exponential[q, k, 3, b] * y
    for i in range(ni):
        if not active[i]:
            continue
        if constant[i]:
            v = values[i, 0]
            for r in range(2 * nb):
                out[r] += state_constant[q, k, i, r] * v
        else:
            for j in range(N):
                v = values[i, j]
                for r in range(2 * nb):
                    out[r] += state_input[q, k, i, j, r] * v


@fused
def dot(rows, q, o, size, w):
    s = 0.0
    for r in range(size):
        s += rows[q, o, r] * w[r]
    return s


@inner
def taylor(blocks, inputs, monomial, q, nb, ni, terms, h, w, values, constant, active, power, series):
    """Taylor polynomial of the state over a step in the scaled time s in [0, 1]: series[c, :] for c < terms.

    w' = T w + sum_i inputs_i p_i(t), with p_i the polynomial through values[i, :] (or its constant). ``power``
    (ni, 8) receives the monomial coefficients of the inputs.
    """
    for i in range(ni):
        for c in range(N):
            s = 0.0
            if active[i] and not constant[i]:
                for j in range(N):
                    s += monomial[c, j] * values[i, j]
            power[i, c] = s
        if active[i] and constant[i]:
            power[i, 0] = values[i, 0]
    for r in range(2 * nb):
        series[0, r] = w[r]
    for c in range(terms - 1):
        scale = h / (c + 1.0)
        for b in range(nb):
            x = series[c, b]
            y = series[c, nb + b]
            series[c + 1, b] = scale * (blocks[q, 0, b] * x + blocks[q, 1, b] * y)
            series[c + 1, nb + b] = scale * (blocks[q, 2, b] * x + blocks[q, 3, b] * y)
        if c < N:
            for i in range(ni):
                p = power[i, c] * scale
                if p != 0.0:
                    for r in range(2 * nb):
                        series[c + 1, r] += inputs[q, i, r] * p


@inner
def state_at(series, terms, size, s, out):
    """out = state at scaled time s."""
    for r in range(size):
        out[r] = series[terms - 1, r]
    for c in range(terms - 2, -1, -1):
        for r in range(size):
            out[r] = out[r] * s + series[c, r]


@inner
def input_at(power, i, s):
    value = power[i, N - 1]
    for c in range(N - 2, -1, -1):
        value = value * s + power[i, c]
    return value


@inner
def output_series(outputs, feed, feed_rate, q, o, size, ni, terms, h, series, power, out):
    """out[c] = Taylor coefficients of output o in the scaled time."""
    for c in range(terms):
        s = 0.0
        for r in range(size):
            s += outputs[q, o, r] * series[c, r]
        out[c] = s
    for i in range(ni):
        f = feed[q, o, i]
        g = feed_rate[q, o, i] / h
        if f != 0.0 or g != 0.0:
            for c in range(N):
                out[c] += f * power[i, c]
            for c in range(N - 1):
                out[c] += g * (c + 1.0) * power[i, c + 1]


@inner
def horner(series, first, terms, s):
    """sum_c series[first + c] s^c."""
    value = series[terms - 1]
    for c in range(terms - 2, first - 1, -1):
        value = value * s + series[c]
    return value


@inner
def horner_slope(series, first, terms, s):
    value = (terms - 1.0 - first) * series[terms - 1]
    for c in range(terms - 2, first, -1):
        value = value * s + (c - first) * series[c]
    return value
