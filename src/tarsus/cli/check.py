"""`tarsus check`: can this be used?"""

from __future__ import annotations

from tarsus.cli.front import worded
from tarsus.cli.options import Json, LawFiles


@worded
def check(
    name: str,
    /,
    *,
    law: LawFiles = None,
    json: Json = False,
) -> int:
    import tarsus
    from tarsus.cli import console

    return console.show(tarsus.check(name, law=law or ()), json)
