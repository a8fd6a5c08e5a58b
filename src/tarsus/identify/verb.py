"""The verb: a device from one campaign, or from several recorded one after the other."""

from __future__ import annotations

import os
from collections.abc import Sequence
from typing import TYPE_CHECKING, overload

from tarsus.base.progress import Progress
from tarsus.identify.campaign import Opened
from tarsus.identify.chain import Identification
from tarsus.identify.chain import identify as identify_one

if TYPE_CHECKING:
    from tarsus.identify.track import Tracking

Recorded = Opened | str | os.PathLike[str]


@overload
def identify(campaign: Recorded, *, seed: int = 1, progress: Progress | None = None) -> Identification: ...
@overload
def identify(
    campaign: Recorded, *, seed: int = 1, progress: Progress | None = None, track: Sequence[Recorded]
) -> Tracking: ...
def identify(
    campaign: Recorded, *, seed: int = 1, progress: Progress | None = None, track: Sequence[Recorded] = ()
) -> Identification | Tracking:
    """Identify a device from the records of a campaign, or of a series of campaigns.

    Parameters
    ----------
    campaign
        Its file (campaign.toml) or the folder that holds it; in Python also what
        `tarsus.identify.campaign.read_campaign` gave.
    seed
        Of the draws.
    progress
        Called as ``progress(done, total, what)``.
    track
        Campaigns on the same device recorded later, in their order: which of its numbers moved.

    Returns
    -------
    Identification or tarsus.identify.track.Tracking
        Every number with its interval and verdict; of a series, over the series.

    Raises
    ------
    InputError
        With every problem of the campaign; if no record could be read, with every reason.
    """
    if not track:
        return identify_one(campaign, seed, progress)
    from tarsus.identify.track import track as over_all

    return over_all([campaign, *track], seed, progress)
