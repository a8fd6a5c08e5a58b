"""`tarsus synthesize`: a campaign of records, as a laboratory would hand it over."""

from __future__ import annotations

from math import isfinite
from typing import Annotated

from cyclopts import Parameter

from tarsus.cli.options import UNCHANGED, Changes, Folder, Json, Overwrite, Seed


def synthesize(
    device: str,
    /,
    *,
    output: Folder,
    seed: Seed = 1,
    snr_db: Annotated[float, Parameter(allow_leading_hyphen=True)] = 40.0,
    rate: str = "20 kHz",
    perturb: float = 0.0,
    changes: Changes = UNCHANGED,
    overwrite: Overwrite = False,
    json: Json = False,
) -> int:
    """Simulate the records of an identification campaign and write its folder, with the truth kept apart.

    Parameters
    ----------
    device
        a device (see `tarsus devices`) or a scene file: what the records are made of.
    output
        folder for campaign.toml, device.toml, the records, and truth/device.toml.
    snr_db
        noise of each channel below its own motion, in dB.
    rate
        samples per second, e.g. "20 kHz".
    perturb
        multiply every number that a campaign identifies by 1 - this to 1 + this, at random.
    """
    from tarsus.base.errors import InputError
    from tarsus.cli import console, requests
    from tarsus.files.output import OutputFolder
    from tarsus.synthesis.campaign_folder import CAMPAIGN_FILES, write_campaign
    from tarsus.synthesis.recordings import Instrument, perturbed

    scene = changes.scene(device)
    hertz = requests.quantities_of(rate=(rate, "Hz"))["rate"]
    if not 1e3 <= hertz <= 1e7:
        raise InputError(f"--rate: expected 1 kHz to 10 MHz, got '{rate}'")
    if not isfinite(snr_db):
        raise InputError(f"--snr-db: expected a finite number, got {snr_db:g}")
    target = OutputFolder(output, "synthesize", CAMPAIGN_FILES, overwrite)
    target.check()
    if perturb:
        scene = perturbed(scene, perturb, seed)
    with target.writing() as folder, console.progress_bar("records") as progress:
        written = write_campaign(scene, folder, Instrument(rate=hertz, snr_db=snr_db), seed, progress)
    size = sum(path.stat().st_size for path in written)
    if json:
        files = [str(path) for path in written]
        console.print_json({"campaign": files[0], "truth": files[-1], "files": files, "bytes": size})
        return 0
    print(f"{len(written)} files, {size / 1e6:.1f} MB; the truth is in {written[-1]}")
    console.wrote([output])
    console.note([f"identify it with `tarsus identify {written[0]} -o FOLDER`"])
    return 0
