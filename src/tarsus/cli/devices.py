"""`tarsus devices`: the devices that can be named."""

from __future__ import annotations

from tarsus.cli.options import Json


def devices(*, json: Json = False) -> int:
    """List the packaged devices and those that installed packages add."""
    import tarsus
    from tarsus.cli import console

    return console.show(tarsus.devices(), json)
