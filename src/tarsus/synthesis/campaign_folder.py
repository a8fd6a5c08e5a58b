"""A folder as a laboratory would hand it over: files of records, a campaign file, and the truth in a place of its
own."""

from __future__ import annotations

import tomllib
from collections.abc import Callable, Sequence
from math import log10
from pathlib import Path

import numpy as np

from tarsus.base.errors import InputError
from tarsus.base.messages import kind_of
from tarsus.base.progress import Progress
from tarsus.base.spec import FrozenDict, float_paths, with_values
from tarsus.files.toml import description_text, write_scene
from tarsus.files.whole import write_text
from tarsus.identify.campaign import Campaign, RecordSet
from tarsus.identify.campaign_file import short_text
from tarsus.identify.estimates import PLACEHOLDER
from tarsus.model.drive.laws import LinearForce
from tarsus.model.drive.laws.prandtl_ishlinskii import PrandtlIshlinskii
from tarsus.model.scene import ModalLoad, Provenance, Scene, Source
from tarsus.model.structure import Beam, Modal, Walker
from tarsus.records.measurement import Measurement
from tarsus.records.purpose import Purpose
from tarsus.records.readers.choices import ChannelChoice
from tarsus.synthesis.devices import identified_paths
from tarsus.synthesis.plan import planned
from tarsus.synthesis.record_files import write_csv, write_hdf, write_mat, write_polytec, write_uff
from tarsus.synthesis.recordings import Instrument, Recording, driven_by, placed, recorded, rest_of

Writer = Callable[[Measurement, Path], dict[str, ChannelChoice]]

_FORMATS: dict[Purpose, tuple[str, Writer]] = {
    Purpose.MODAL: (".uff", write_uff),
    Purpose.LOOPS: (".txt", write_polytec),
    Purpose.RAMPS: (".mat", write_mat),
    Purpose.BOUNCES: (".h5", write_hdf),
    Purpose.AIR: (".h5", write_hdf),
    Purpose.CLOSE: (".mat", write_mat),
    Purpose.VALIDATION: (".csv", write_csv),
    Purpose.WALKING: (".h5", write_hdf),
}
CAMPAIGN_FILES = (
    "campaign.toml",
    "device.toml",
    "truth/device.toml",
    "sweep-*.uff",
    "loops*.txt",
    "ramps-*.mat",
    "close-*.mat",
    "bounces-*.h5",
    "air-*.h5",
    "held-out-*.csv",
    "walk-*.h5",
    "exercise-*.h5",
)
"""Everything that a campaign of all planned recordings writes, as glob patterns."""

_PLACEHOLDERS = {
    "frequencies": (600.0, 6000.0),
    "damping_ratios": 0.02,
    "participation": 1.0,
    "linear": 1e-6,
    "gain": 1e-6,
    "ground.restitution.coefficient": 0.5,
    "ground.film.coefficient": 1e-20,
    "ground.film.thickness": 1e-5,
    "ground.electrostatic.coefficient": 1e-16,
    "ground.electrostatic.offset": 1e-4,
}
"""Values that say nothing of the device, whose order of magnitude lets it be simulated."""


def unknown_device(scene: Scene) -> Scene:
    """A device with everything that a campaign identifies replaced by placeholders, which say nothing of it.

    Of a walker the ground's numbers alone, by powers of ten near them: its legs are designed, and known about.
    """
    paths = identified_paths(scene)
    if isinstance(scene.robot.structure, Walker):
        known = float_paths(scene)
        paths = [path for path in paths if path.startswith("ground.")]
        values = {path: _GROUND.get(path) or _power_of_ten(known[path].value) for path in paths}
    else:
        values = _blank_values(scene, paths)
    blank = with_values(scene, values)
    origin = Provenance(source=Source.ASSUMED, note=PLACEHOLDER)
    listed = {path.rpartition(".")[0] if path.rpartition(".")[2].isdecimal() else path for path in values}
    inside = {path for path in scene.provenance if any(path.startswith(f"{one}.") for one in listed)}
    kept = {path: one for path, one in scene.provenance.items() if path not in inside}
    unit = Provenance(source=Source.ASSUMED, note="The unit of the drive's force, by choice.")
    modal = [name for name, drive in scene.robot.drives.items() if isinstance(drive.load, ModalLoad)]
    units = {f"robot.drives.{name}.load.participation.0": unit for name in modal}
    gaps = {} if isinstance(scene.robot.structure, Walker) else _set_gaps(scene)
    return with_values(blank, {"provenance": kept | gaps | dict.fromkeys(listed, origin) | units})


_GAP_SET = 0.01
"""Error, as a share, to which a gap is set: a stage is read to a micrometre, of some tens to a hundred."""


def _set_gaps(scene: Scene) -> dict[str, Provenance]:
    """The provenance of every gap, with an interval where it states none: a gap is set by hand, and the constant of the
    drive's law counts from it."""
    out: dict[str, Provenance] = {}
    for name, foot in scene.robot.feet.items():
        path = f"robot.feet.{name}.gap"
        if foot.gap > 0.0 and scene.interval(path) is None:
            origin = scene.origin(path)
            low, high = (float(f"{foot.gap * by:.4g}") for by in (1.0 - _GAP_SET, 1.0 + _GAP_SET))
            said = "" if origin is None else f" {origin.note}"
            source = Source.ASSUMED if origin is None else origin.source
            note = f"Set by hand, to {100.0 * _GAP_SET:g} %.{said}"
            out[path] = Provenance(source=source, note=note, interval=((low, high),))
    return out


_GROUND = {"ground.restitution.coefficient": 0.5, "ground.friction.coefficient": 0.3}
"""Placeholders of the ground of a walker that are no powers of ten."""


def _power_of_ten(value: float) -> float:
    return float(f"1e{round(log10(value))}") if value > 0.0 else 0.0


def _blank_values(scene: Scene, paths: Sequence[str]) -> dict[str, float]:
    """A placeholder for every path of a foot's device; those of the frequencies are in their order."""
    values: dict[str, float] = {}
    known = float_paths(scene)
    frequencies = sorted((path for path in paths if ".frequencies." in path), key=lambda one: known[one].value)
    for path in paths:
        parts = path.split(".")
        key = next((k for k in (path, *reversed(parts)) if k in _PLACEHOLDERS), "")
        given = _PLACEHOLDERS.get(key, 0.0)
        if isinstance(given, tuple):
            place = frequencies.index(path)
            given = given[place] if len(frequencies) == len(given) else 100.0 * (place + 1.0)
        values[path] = given
    return values


def write_campaign(
    scene: Scene,
    folder: Path,
    instrument: Instrument,
    seed: int,
    progress: Progress | None = None,
    recordings: Sequence[Recording] | None = None,
    *,
    nominal: Scene | None = None,
) -> list[Path]:
    """Simulate a campaign on a device and write its folder.

    Parameters
    ----------
    scene
        The device, as it truly is.
    folder
        Gets campaign.toml, device.toml, the records, and truth/device.toml, which no step reads.
    instrument
        The vibrometer.
    seed
        Of the noise.
    progress
        Called as ``progress(done, total, what)``.
    recordings
        What is recorded; by default all of `planned`.
    nominal
        The device as designed, of which device.toml is made; the true one unless given.

    Returns
    -------
    list[Path]
        All files, the campaign file first.

    Raises
    ------
    InputError
        For a device that identification cannot tell from a campaign, or one whose records cannot be simulated.
    """
    _check_identifiable(scene)
    walks = isinstance(scene.robot.structure, Walker)
    drive, foot = next(iter(scene.robot.drives)), next(iter(scene.robot.feet))
    if recordings is None:
        recordings = planned(scene, instrument.rate, drive)
    total = sum(recording.repeats for recording in recordings)
    folder.mkdir(parents=True, exist_ok=True)
    sets: dict[str, RecordSet] = {}
    written: list[Path] = []
    for number, recording in enumerate(recordings):
        suffix, write = _FORMATS[recording.purpose]
        names: list[str] = []
        said: dict[str, ChannelChoice] = {}
        if progress is not None:
            progress(len(written), total, recording.name)
        seeds = range(1000 * seed + 31 * number, 1000 * seed + 31 * number + recording.repeats)
        recorder = _first_moving(scene, recording) if walks else drive
        for repeat, record in enumerate(recorded(scene, recording, instrument, recorder, seeds)):
            name = f"{recording.name}-{repeat + 1}{suffix}" if recording.repeats > 1 else f"{recording.name}{suffix}"
            said = write(record, folder / name)
            names.append(name)
            written.append(folder / name)
        sets[recording.name] = _described(recording, tuple(names), said, driven_by(recording, drive))
    blank = unknown_device(nominal or scene)
    write_scene(blank, folder / "device.toml")
    campaign = Campaign(
        name=f"{scene.name}, synthetic campaign of seed {seed}",
        device="device.toml",
        foot=None if walks else foot,
        drive=None if walks else drive,
        records=sets,
    )
    write_text(folder / "campaign.toml", short_text(tomllib.loads(description_text(campaign))))
    (folder / "truth").mkdir(exist_ok=True)
    write_scene(scene, folder / "truth" / "device.toml")
    return [folder / "campaign.toml", folder / "device.toml", *written, folder / "truth" / "device.toml"]


def _check_identifiable(scene: Scene) -> None:
    """Raise InputError, in one sentence, for a device of a kind that `identify` does not know."""
    robot, amiss = scene.robot, []
    if isinstance(robot.structure, Walker):
        return
    if not isinstance(robot.structure, Beam | Modal):
        amiss.append(f"its structure is of the kind '{robot.structure.kind}', not 'beam', 'modal' or 'walker'")
    if len(robot.drives) != 1:
        amiss.append(f"it has {len(robot.drives)} drives, not one")
    amiss += [
        f"the law of '{name}' is of the kind '{kind_of(type(drive.law))}', not 'prandtl_ishlinskii' or 'linear'"
        for name, drive in robot.drives.items()
        if not isinstance(drive.law, PrandtlIshlinskii | LinearForce)
    ]
    if len(robot.feet) != 1:
        amiss.append(f"it has {len(robot.feet)} feet, not one")
    if amiss:
        raise InputError(f"'{scene.name}' cannot be identified from a campaign: {'; '.join(amiss)}")


def _first_moving(scene: Scene, recording: Recording) -> str:
    """Name of the first drive whose volts a walk changes: they are recorded, for its beginning."""
    waveforms = placed(scene, recording, "").waveforms
    moving = (name for name, wave in waveforms.items() if np.ptp(wave.volts(recording.duration * _TRIED)) > 0.0)
    return next(moving, next(iter(scene.robot.drives)))


_TRIED = np.linspace(0.0, 1.0, 1001)
"""Parts of a walk at which its volts are looked at."""


def _described(recording: Recording, files: tuple[str, ...], said: dict[str, ChannelChoice], drive: str) -> RecordSet:
    return RecordSet(
        purpose=recording.purpose,
        files=files,
        rest=rest_of(recording),
        gap=recording.gap,
        signal=recording.signal,
        gait=recording.gait,
        signals=FrozenDict(recording.signals),
        bridge=recording.purpose is Purpose.WALKING,
        air=recording.air,
        channels=said,
        drive=drive,
    )
