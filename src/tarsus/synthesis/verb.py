"""The verb `tarsus.synthesize`: a campaign of records, as a laboratory would hand it over."""

from __future__ import annotations

import os
import shlex
from math import isfinite
from pathlib import Path

from tarsus.base.errors import InputError
from tarsus.base.progress import Progress
from tarsus.base.units import quantity_of
from tarsus.base.verb import verb
from tarsus.files.library import SceneLike, as_scene
from tarsus.plan.lowering import still_only
from tarsus.synthesis.campaign_folder import write_campaign
from tarsus.synthesis.devices import perturbed
from tarsus.synthesis.recordings import Instrument
from tarsus.tables.table import Table
from tarsus.tables.view import View

SLOWEST, FASTEST = 1e3, 1e7
"""Sampling rates [Hz]: below, no impact of such a robot is seen; above, no recorder of the field goes."""


@verb
def synthesize(
    device: SceneLike,
    output: str | os.PathLike[str],
    *,
    seed: int = 1,
    snr_db: float = 40.0,
    rate: float | str = "20 kHz",
    perturb: float | str = "0 %",
    progress: Progress | None = None,
) -> View:
    """Simulate the records of an identification campaign and write its folder, with the truth kept apart.

    Parameters
    ----------
    device
        A device, a scene file or a scene: what the records are made of.
    output
        Folder for campaign.toml, device.toml, the records, and truth/device.toml, which no step reads.
    seed
        Of the noise and of what is perturbed.
    snr_db
        Noise of each channel below its own motion [dB].
    rate
        Samples per second [Hz].
    perturb
        Multiply every number that a campaign identifies by 1 - this to 1 + this, at random: 0.2 or "20 %".
    progress
        Called as ``progress(done, total, what)``.

    Returns
    -------
    View
        The files, the campaign's first and the truth's last.

    Raises
    ------
    InputError
        For a rate or a noise that no instrument has, and a device that no campaign identifies.
    """
    instrument = checked_instrument(rate, snr_db)
    scene = as_scene(device)
    still_only(scene, "records are made of robots")
    share = quantity_of("perturb", perturb, "1")
    device_made = perturbed(scene, share, seed) if share else scene
    written = write_campaign(device_made, Path(output), instrument, seed, progress, nominal=scene)
    size = sum(path.stat().st_size for path in written)
    files = [str(path) for path in written]
    data = {"campaign": files[0], "truth": files[-1], "files": files, "bytes": size}
    title = f"{len(written)} files, {size / 1e6:.1f} MB; the truth is in {written[-1]}"
    return View(data, Table(title, (), ()), (f"identify it with `tarsus identify {shlex.quote(files[0])} -o FOLDER`",))


def checked_instrument(rate: float | str, snr_db: float) -> Instrument:
    """The instrument of a rate [Hz] and a noise [dB]; InputError where there is none such."""
    hertz = quantity_of("rate", rate, "Hz")
    if not SLOWEST <= hertz <= FASTEST:
        raise InputError(f"rate: expected 1 kHz to 10 MHz, got '{rate}'")
    if not isfinite(snr_db):
        raise InputError(f"snr_db: expected a finite number, got {snr_db:g}")
    return Instrument(rate=hertz, snr_db=snr_db)
