"""`tarsus devices`: the devices that can be named."""

from __future__ import annotations

from tarsus.cli.front import worded
from tarsus.cli.options import Json


@worded
def devices(*, json: Json = False) -> int:
    import tarsus
    from tarsus.cli import console

    return console.show(tarsus.devices(), json)
