"""`tarsus show`: what a name stands for, or how two of a kind differ."""

from __future__ import annotations

from tarsus.cli.options import Json, LawFiles, Many


def show(
    name: str,
    other: str | None = None,
    /,
    *,
    channel: Many = None,
    axis: str | None = None,
    axis_unit: str | None = None,
    step: str | None = None,
    drive: str | None = None,
    law: LawFiles = None,
    json: Json = False,
) -> int:
    """Show what a device, study, file or folder holds; of two runs, devices or scene files, how they differ.

    Parameters
    ----------
    name
        a device (see `tarsus devices`) or packaged study, a file (TOML), the folder of a run, sweep or campaign, or a
        record: UFF 55/58, MATLAB, HDF5, NetCDF, TDMS, LVM, CSV or ASCII.
    other
        what it is compared with: runs with runs, descriptions with descriptions.
    channel
        of a record: name=unit of a channel whose unit the file does not say, or its name alone; may be repeated.
    axis
        of a record: series of the times or frequencies, where the file does not say.
    axis_unit
        its unit.
    step
        of a record: time between samples, e.g. "50 us", where the file has no times.
    drive
        of a record: channel that recorded the drive.
    """
    import tarsus
    from tarsus.cli import console

    said = {"axis": axis, "axis_unit": axis_unit, "step": step, "drive": drive}
    found = tarsus.show(name, other, channel=channel or (), law=law or (), **said)
    return console.show(found, json)
