"""Drive channels inside the kernels: piecewise polynomials of time with marked kinks, looping for ever."""

from __future__ import annotations

import math
from collections import namedtuple

from tarsus.core.jit import fused, inner
from tarsus.core.nodes import N

# first (nc+1,): pieces of channel c are first[c] .. first[c+1]-1; start, end (P,) [s]; coef (P, 12) in
# xi = 2 (t - start)/(end - start) - 1; flat (P,): constant piece; sharp (P,): its end is a kink; until (P,): time
# from its start to the next kink (inf: none); over (P,) [s]: how far the piece before that kink may be continued
# beyond it; loop (nc,): piece to go on with after the last one, or -1; period (nc,) [s]; span (nc,) range of values.
Signals = namedtuple("Signals", "first start end coef flat sharp until over loop period span")


@fused
def seek(first, start, end, loop, period, cursor, channel, t):
    """Move the cursor of a channel to the piece that holds time ``t`` (forward only)."""
    while True:
        p = cursor[channel, 0]
        shift = cursor[channel, 1] * period[channel]
        # within the rounding of the time itself the piece has ended: no step could reach its end
        if t < shift + end[p] - 1e-12 * (end[p] - start[p]) - 1e-15 * t:
            return
        if p + 1 < first[channel + 1]:
            cursor[channel, 0] = p + 1
        elif loop[channel] >= 0:
            cursor[channel, 0] = first[channel] + loop[channel]
            cursor[channel, 1] += 1
        else:
            return


@fused
def polynomial(coef, p, xi):
    value = coef[p, 11]
    for c in range(10, -1, -1):
        value = value * xi + coef[p, c]
    return value


@fused
def fill(first, start, end, coef, flat, sharp, loop, period, cursor, channel, t, h, tau, out, row):
    """Values of a channel at the nodes of the step [t, t+h] into out[row]; True if they are constant.

    A step may reach beyond a kink: the stretch before the kink is continued, and the step is cut at the kink.
    """
    p = cursor[channel, 0]
    turns = cursor[channel, 1]
    shift = turns * period[channel]
    if flat[p] and (sharp[p] or t + h <= shift + end[p]):
        for j in range(N):
            out[row, j] = coef[p, 0]
        return True
    # times from the start of the piece: those from t = 0 would round each node differently, which a short piece shows
    begun = t - shift - start[p]
    for j in range(N):
        while begun + tau[j] * h > end[p] - start[p] and not sharp[p]:
            if p + 1 < first[channel + 1]:
                p += 1
            elif loop[channel] >= 0:
                p = first[channel] + loop[channel]
                turns += 1
                shift = turns * period[channel]
            else:
                break
            begun = t - shift - start[p]
        out[row, j] = polynomial(coef, p, 2.0 * (begun + tau[j] * h) / (end[p] - start[p]) - 1.0)
    return False


@inner
def value(first, start, end, coef, loop, period, cursor, channel, t):
    """Value of a channel at time ``t`` within the cursor's piece (from the left at a kink)."""
    p = cursor[channel, 0]
    shift = cursor[channel, 1] * period[channel]
    return polynomial(coef, p, 2.0 * (t - shift - start[p]) / (end[p] - start[p]) - 1.0)


@fused
def next_kink(signals, cursor, nc, t):
    """Move all channels to ``t``; time to the next kink and the longest admissible reach beyond it [s]."""
    kink = math.inf
    reach = math.inf
    for c in range(nc):
        seek(signals.first, signals.start, signals.end, signals.loop, signals.period, cursor, c, t)
        p = cursor[c, 0]
        shift = cursor[c, 1] * signals.period[c]
        left = shift + signals.start[p] + signals.until[p] - t
        if left < kink:
            kink = left
        if not (signals.flat[p] and signals.sharp[p]):
            reach = min(reach, left + signals.over[p])
    return kink, reach
