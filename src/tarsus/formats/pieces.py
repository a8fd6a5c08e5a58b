"""Files that hold several records: under headers of their own, or more samples than their one header announces."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from tarsus.base.arrays import Floats
from tarsus.formats.raw import RawFile


def by_count(found: RawFile, times: Sequence[Floats]) -> list[RawFile]:
    """The records below one header: all of it where as many samples follow as it announces, or their times go on; else
    pieces of the number announced.

    times: columns of times (ns,), where there are any. A note says what goes beyond.
    """
    counts = {one.count for one in found.series if one.count is not None and one.count > 1}
    length = max((len(one.values) for one in found.series), default=0)
    if len(counts) != 1 or length <= max(counts):
        return [found]
    count = max(counts)
    said = f"{found.source}: its header announces {count} samples, and {length} follow"
    if times and all(np.all(np.diff(one) > 0.0) for one in times):
        return [replace(found, notes=(*found.notes, f"{said}, whose times go on: all are used"))]
    whole, rest = divmod(length, count)
    pieces = [_piece(found, k * count, min((k + 1) * count, length)) for k in range(whole + (rest > 1))]
    if rest == 1:
        pieces[-1] = replace(pieces[-1], notes=(*pieces[-1].notes, f"{said}: the last one is not used"))
    return pieces


def several(records: Sequence[RawFile], headers: int) -> RawFile:
    """The records of a file with so many headers as one content, of which one is chosen later."""
    if len(records) == 1:
        return records[0]
    lengths = [max(len(one.values) for one in record.series) for record in records]
    below = "" if headers > 1 else f", though its one header announces {lengths[0]}"
    return replace(records[0], several=tuple(records), cause=f", {sum(lengths)} samples in all{below}")


def _piece(found: RawFile, first: int, last: int) -> RawFile:
    """The samples from one on to before another."""
    series = (
        replace(
            one,
            values=one.values[first:last],
            axis=one.axis and replace(one.axis, values=one.axis.values[first:last]),
            count=last - first,
        )
        for one in found.series
        if len(one.values) > first + 1
    )
    return replace(found, series=tuple(series))
