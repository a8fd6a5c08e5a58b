"""`tarsus check`: can this be used?"""

from __future__ import annotations

from tarsus.cli.options import Json, LawFiles


def check(
    name: str,
    /,
    *,
    law: LawFiles = None,
    json: Json = False,
) -> int:
    """Check a device, a scene, a study, a calibration or a campaign with all its records; name all errors at once.

    Parameters
    ----------
    name
        a device or packaged study by name, a file (TOML), a record, or the folder of a campaign, run or sweep.
    """
    import tarsus
    from tarsus.cli import console

    return console.show(tarsus.check(name, law=law or ()), json)
