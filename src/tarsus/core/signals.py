"""Drive channels for the engine: piecewise polynomials of time with marked kinks, looping for ever."""

from __future__ import annotations

from collections import namedtuple

# first (nc+1,): pieces of channel c are first[c] .. first[c+1]-1; start, end (P,) [s]; coef (P, 12) in
# xi = 2 (t - start)/(end - start) - 1; flat (P,): constant piece; sharp (P,): its end is a kink; until (P,): time
# from its start to the next kink (inf: none); over (P,) [s]: how far the piece before that kink may be continued
# beyond it; loop (nc,): piece to go on with after the last one, or -1; period (nc,) [s]; span (nc,) range of values.
Signals = namedtuple("Signals", "first start end coef flat sharp until over loop period span")
