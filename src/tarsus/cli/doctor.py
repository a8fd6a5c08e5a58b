"""`tarsus doctor`: is this installation sound?"""

from __future__ import annotations

from tarsus.cli.options import Json


def doctor(*, json: Json = False) -> int:
    """Show versions, processor and threads, and check the engine against a closed form.

    Exit code 1 when something is wrong.
    """
    import tarsus
    from tarsus.cli import console
    from tarsus.inspection.installation import CLOSE

    found = tarsus.doctor()
    console.show(found, json)
    if found.to_dict()["engine_error"] < CLOSE:
        return 0
    console.complain(
        ["the engine does not find the impacts of a bouncing ball; build it again for this machine"]
    )
    return 1
