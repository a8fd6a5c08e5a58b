"""`tarsus synthesize`: a campaign of records, as a laboratory would hand it over."""

from __future__ import annotations

from typing import Annotated

from cyclopts import Parameter

from tarsus.cli.front import worded
from tarsus.cli.options import UNCHANGED, Changes, Folder, Json, Overwrite, Seed


@worded
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
    import tarsus
    from tarsus.cli import console, requests
    from tarsus.files.output import OutputFolder
    from tarsus.synthesis.campaign_folder import CAMPAIGN_FILES
    from tarsus.synthesis.verb import checked_instrument

    scene = changes.scene(device)
    hertz = requests.quantities_of(rate=(rate, "Hz"))["rate"]
    checked_instrument(hertz, snr_db)  # before a file is touched
    target = OutputFolder(output, "synthesize", CAMPAIGN_FILES, overwrite)
    target.check()
    with target.writing() as folder, console.progress_bar("records") as progress:
        found = tarsus.synthesize(
            scene, folder, seed=seed, snr_db=snr_db, rate=hertz, perturb=perturb, progress=progress
        )
    return console.show(found, json, [output])
