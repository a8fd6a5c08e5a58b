"""The verb that begins: a device, a law, a study, a design, or a campaign of records, as a file to be completed."""

from __future__ import annotations

import os
import shlex
from importlib.resources import files as packaged
from pathlib import Path
from typing import Literal

from tarsus.base.errors import InputError
from tarsus.base.messages import together
from tarsus.base.verb import verb
from tarsus.files.installed import device_title
from tarsus.files.library import load_scene
from tarsus.files.toml import scene_text
from tarsus.files.whole import write_text
from tarsus.inspection.begin_campaign import campaign_text
from tarsus.inspection.begin_design import design_text
from tarsus.inspection.begin_study import study_text
from tarsus.inspection.begin_walker import walker_text
from tarsus.tables.table import Table
from tarsus.tables.view import View

KINDS = {
    "device": ("device.toml", "run it with `tarsus simulate {} -o FOLDER`"),
    "law": ("law.py", "try it with `tarsus simulate cantilever --law {}`"),
    "study": ("study.toml", "run it with `tarsus sweep {} -o FOLDER`"),
    "design": ("design.toml", "run it with `tarsus design {} -o FOLDER`"),
    "campaign": ("campaign.toml", "say what each set is for, then `tarsus check {0}` and `tarsus identify {0}`"),
}
"""Kinds of files: a name of one, which of a device and a law is that of its template, and what to do with it."""


@verb
def new(
    kind: Literal["device", "law", "study", "design", "campaign"],
    path: str | os.PathLike[str],
    *,
    device: str | None = None,
    legs: int | None = None,
    mass: float | str | None = None,
) -> View:
    """Write a file to begin with: a device, a law of the ground, a study, a design, or a campaign of records.

    Parameters
    ----------
    kind
        device, study and design are files of a scene, a study and a design (TOML), law a Python file, campaign a
        campaign.toml for the records that lie in a folder.
    path
        The file to write, which is never replaced; for a campaign the folder of its records.
    device
        What to begin with: of a device a packaged one to copy, of a study or a design its scene, of a campaign
        what is known beforehand.
    legs
        Of a device: a robot that walks on so many legs, from 1 to 40; without it one foot on a vibrating structure.
    mass
        Mass of the body of a robot with legs, such as "0.1 g"; 25 mg a leg when left out. Springs and drives follow it.

    Returns
    -------
    View
        The file that was written, what to do with it, and remarks on the records.

    Raises
    ------
    InputError
        Where there is such a file already, or no records, or a device that cannot be read.
    """
    if kind not in KINDS:
        raise InputError(f"kind: expected one of {', '.join(KINDS)}, got '{kind}'")
    name, onward = KINDS[kind]
    target, wanted = Path(path) / name if kind == "campaign" else Path(path), Path(name).suffix
    if target.suffix != wanted:
        raise InputError(f"'{target}': a {kind} is a {wanted} file")
    if target.exists():
        raise InputError(f"'{target}' is there already, and stays as it is; give another name")
    if (legs is not None or mass is not None) and (kind != "device" or device is not None or legs is None):
        raise InputError('--legs and --mass: they make a new device, `tarsus new device FILE --legs 4 --mass "0.1 g"`')
    text, remarks = "", []
    if legs is not None:
        text = walker_text(legs, mass)
    elif kind == "campaign":
        text, remarks = campaign_text(Path(path), device)
    else:
        made = {"study": study_text, "design": design_text}.get(kind)
        text = _text(kind, device) if made is None else made(device, target.parent)
    write_text(target, text)
    data = {"file": str(target), "remarks": remarks}
    said = f"wrote {target}; {onward.format(shlex.quote(str(target)))}"
    return View(data, Table(said, (), ()), tuple(together(remarks)))


def _text(kind: str, device: str | None) -> str:
    """A packaged device as it is, or the template of a device or a law."""
    if device is not None and kind == "law":
        raise InputError("--device: a law belongs to no device")
    if device is not None:
        text, title = scene_text(load_scene(device)), device_title(device)
        return f"# {title}\n{text}" if title else text
    return (packaged("tarsus.inspection") / "templates" / KINDS[kind][0]).read_text(encoding="utf-8")
