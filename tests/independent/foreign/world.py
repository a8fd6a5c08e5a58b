"""The device of the foreign laboratory, and how its world may differ from what an identification assumes."""

from __future__ import annotations

from dataclasses import dataclass, fields, replace

import numpy as np


@dataclass(frozen=True)
class Device:
    """Numbers of a cantilever with a rigid tip above a ground, SI.

    participation: of both modes in the drive's force; law: constant, linear, quadratic and cubic gain; weights of the
    plays; gap: of the foot at the neutral position; film: coefficient [N m^2 s] and thickness [m]; adhesion: at touch
    [N] and its growth [N/s].
    """

    frequencies: tuple[float, ...] = (623.0, 6424.0)
    damping: tuple[float, ...] = (0.0108677, 0.0720721)
    participation: tuple[float, ...] = (0.117303, 5.81282)
    law: tuple[float, ...] = (-1.27075e-6, -7.36612e-7, -8.95e-9, 2.94905e-9)
    thresholds: tuple[float, ...] = (1.143, 2.286, 3.429, 4.571, 5.714, 6.857)
    weights: tuple[float, ...] = (0.0, 0.0, 0.0, -1.0835e-7, 0.0, -4.42899e-7)
    history: tuple[float, ...] = (10.0, 0.0)
    gap: float = 70e-6
    restitution: float = 0.401712
    adhesion: tuple[float, float] = (2.5e-7, 1.7e-6)
    film: tuple[float, float] = (1.747e-21, 58e-6)
    length: float = 750e-6
    tip: tuple[float, float, float] = (150e-6, 100e-6, 10e-6)
    density: float = 2330.0

    def drawn(self, spread: float, seed: int) -> Device:
        """Another device, its unknown numbers within a share of these."""
        random = np.random.default_rng([seed, 77])
        changed: dict[str, object] = {}
        for name in ("frequencies", "damping", "law", "weights", "adhesion", "film", "restitution"):
            value = np.asarray(getattr(self, name), dtype=float)
            new = value * (1.0 + spread * random.uniform(-1.0, 1.0, value.shape))
            changed[name] = float(new) if value.ndim == 0 else tuple(new.tolist())
        second = self.participation[1] * (1.0 + spread * float(random.uniform(-1.0, 1.0)))
        return replace(self, participation=(self.participation[0], second), **changed)  # type: ignore[arg-type]


_SEEN = frozenset(
    (
        "late",
        "behind",
        "filtered",
        "gain",
        "hum",
        "bits",
        "lost",
        "colour",
        "coupled",
        "trigger",
        "warming",
        "gap",
        "long",
        "into_v",
        "into_x",
        "wanders",
        "high_v",
        "jitter",
        "table",
        "speeds",
        "echo",
        "rings",
        "dropped",
        "swapped",
    )
)
"""What of a world moves nothing."""


@dataclass(frozen=True)
class World:
    """What differs from the model; every default is no difference.

    late [s]: of the displacements behind the velocities; behind [s]: of all motion behind the volts; filtered [Hz]:
    fourth-order low-pass of all motion; exponent: of the film in the gap; stiffening: share by which the first
    mode's spring is stiffer at its largest use; creep: share of the drive's force that follows late, after 0.3 s;
    third: share of the extra mode in the static motion of the foot; thresholds [V]: of the true plays; slow [m/s]:
    speed below which a rebounding foot is captured, 0 where it is captured unless pulled; fading: exponent by which
    restitution falls with speed. Own: gain: factor on the foot's displacement; drift [m]: by which the ground sinks
    from record to record; ground [N/m]: its stiffness, infinite where rigid; hum: amplitude at 50 Hz on the
    displacements, in deviations of their noise; pace: share by which the clock of the vibrometer runs fast; ageing
    [s]: time after which adhesion grows no more. Of instruments: bits: of a converter whose range is four times the
    signal's; lost [1/s]: drop-outs of the light; colour: power of the frequency along which the noise falls; coupled
    [Hz]: high-pass of the displacements; trigger [s]: deviation of each record's start from the drive's; warming: share
    by which all gains change over the campaign. Of the drive: slew [V/s]: of an amplifier before which the volts are
    recorded; unpoled: whether a record begins with the plays as the last one left them. Of the motion: drag [kg/m]: of
    the air on the foot, with the square of its speed; charge [N m^2/V^2]: of an attraction by the drive's volts, at
    `drive.CHARGE_GAP` beyond contact; scatter: share by which adhesion and restitution differ from contact to contact.
    Of what is stated: gap, long: factors on the gap and on the length of the tip in the device file.

    Further, of the structure: relaxing: share of every mode's spring that relaxes in ``relaxes``, its poles
    being the device's; rocks: share of the first mode's shape at the foot that a mode of the foot alone has there,
    which the drive does not move; softening, humid, dulling: shares by which frequencies, adhesion and restitution
    change over the campaign, being the device's in the middle of the sweeps, ramps and bounces; remounted: standard
    deviation of the gap from file to file, a share of it; other: share by which the device in one file,
    `campaign.OTHER`, is another one; spot [m]: by which the laser on the tip is nearer to the beam than the foot. Of
    the ground: slip [m]: mean free path of the film's gas; reach [m]: length over which adhesion at touch still
    attracts a foot that has left. Of the drive:
    creeping: share of its force that follows in each decade of time from 1 ms to 10 s; lagging [s]: of its plays
    behind the volts; held [Hz]: rate of a converter that holds its samples; pole [Hz]: of the amplifier; offset [V]:
    of the amplifier; the volts are recorded before all three. Of instruments: into_v [m/s/V], into_x [m/V]: crosstalk
    of the volts; wanders [m/s]: standard deviation of the drift of a displacement's zero; high_v [Hz]: high-pass of
    the velocities; jitter [s]: of every sample; table [m]: vibration of all that is seen at 35 Hz; speeds: factor on
    velocities; echo: share of the tip's motion that the channels of the centre show as well.

    Ten by one who has not read what identifies. Of the structure: relaxes [s]: in which ``relaxing`` happens; sideways:
    static motion that the laser shows of a bending along the ground, a share of the first mode's; warmer: share by
    which frequencies are lower outside the sweeps. Of the ground: uneven: share by which the film is thicker on one
    half of the foot and thinner on the other; dust [m]: a grain under the foot in some files, on which adhesion is
    `campaign.ON_DUST` of the device's. Of the drive: sag: share by which the amplifier's gain is less at 8 V and
    100 Hz, as the power is. Of instruments: roams [m]: deviation of the laser's spot on the tip from file to file;
    rings [m]: by which every impact sets the head of the lasers ringing; dropped [1/s]: samples of the motion that
    were lost, the later ones having moved up; swapped: cables of tip and centre in one file, `campaign.SWAPPED`.
    """

    late: float = 0.0
    behind: float = 0.0
    filtered: float = np.inf
    exponent: int = 3
    stiffening: float = 0.0
    creep: float = 0.0
    third: float = 0.0
    thresholds: tuple[float, ...] = ()
    slow: float = 0.0
    fading: float = 0.0
    gain: float = 1.0
    drift: float = 0.0
    ground: float = np.inf
    hum: float = 0.0
    pace: float = 0.0
    ageing: float = np.inf
    bits: int = 0
    lost: float = 0.0
    colour: float = 0.0
    coupled: float = 0.0
    trigger: float = 0.0
    warming: float = 0.0
    slew: float = np.inf
    unpoled: bool = False
    drag: float = 0.0
    charge: float = 0.0
    scatter: float = 0.0
    gap: float = 1.0
    long: float = 1.0
    relaxing: float = 0.0
    rocks: float = 0.0
    softening: float = 0.0
    humid: float = 0.0
    dulling: float = 0.0
    remounted: float = 0.0
    other: float = 0.0
    spot: float = 0.0
    slip: float = 0.0
    reach: float = 0.0
    creeping: float = 0.0
    lagging: float = 0.0
    held: float = 0.0
    pole: float = 0.0
    offset: float = 0.0
    into_v: float = 0.0
    into_x: float = 0.0
    wanders: float = 0.0
    high_v: float = 0.0
    jitter: float = 0.0
    table: float = 0.0
    speeds: float = 1.0
    echo: float = 0.0
    relaxes: float = 2e-4
    sideways: float = 0.0
    warmer: float = 0.0
    uneven: float = 0.0
    dust: float = 0.0
    sag: float = 0.0
    roams: float = 0.0
    rings: float = 0.0
    dropped: float = 0.0
    swapped: bool = False

    @property
    def changing(self) -> bool:
        """Whether no two records move alike."""
        return bool(
            self.drift
            or self.unpoled
            or self.scatter
            or self.softening
            or self.humid
            or self.dulling
            or self.remounted
            or self.other
            or self.warmer
            or self.dust
            or self.roams
        )

    @property
    def moving(self) -> World:
        """The same without what is its instruments' or only stated: things move alike there."""
        own = {f.name: f.default for f in fields(self) if f.name in _SEEN}
        return replace(self, **own)  # type: ignore[arg-type]

    @property
    def differs(self) -> tuple[str, ...]:
        """Names of what differs."""
        return tuple(f.name for f in fields(self) if getattr(self, f.name) != f.default)


WORLDS = {
    "sound": World(),
    "displacement 6 us late": World(late=6e-6),
    "displacement 20 us late": World(late=20e-6),
    "anti-alias filter": World(filtered=8e3),
    "film exponent 2": World(exponent=2),
    "cubic stiffness": World(stiffening=0.02),
    "creep of the drive": World(creep=0.08),
    "third mode": World(third=0.02),
    "other thresholds": World(thresholds=(0.9, 1.8, 2.9, 4.1, 5.2, 6.3)),
    "rebounds until slow": World(slow=0.01),
    "restitution falls with speed": World(fading=0.15),
    "gain of a channel": World(gain=1.03),
    "ground drifts": World(drift=6e-8),
    "compliant ground": World(ground=5.0),
    "mains hum": World(hum=1.5),
    "clock 100 ppm off": World(pace=1e-4),
    "adhesion that ages": World(ageing=0.03),
    "coarse converter": World(bits=10),
    "lost fringes": World(lost=10.0),
    "coloured noise": World(colour=1.0),
    "coupled displacement": World(coupled=0.1),
    "trigger jitter": World(trigger=15e-6),
    "gains warm up": World(warming=0.02),
    "slow amplifier": World(slew=1e5),
    "no poling between": World(unpoled=True),
    "drag of the air": World(drag=2e-8),
    "attraction by the volts": World(charge=2e-19),
    "weak attraction": World(charge=1e-20),
    "contacts scatter": World(scatter=0.1),
    "gap misstated": World(gap=1.05),
    "tip misstated": World(long=1.05),
    "creep, and late": World(creep=0.08, late=6e-6),
    "third mode, and restitution falls": World(third=0.02, fading=0.15),
    "spring that relaxes": World(relaxing=0.02),
    "foot that rocks": World(rocks=0.2),
    "frequencies drift": World(softening=1e-3),
    "adhesion drifts": World(humid=0.2),
    "restitution drifts": World(dulling=-0.6),
    "foot remounted": World(remounted=0.02),
    "another device in one file": World(other=0.05),
    "spot off the foot": World(spot=22e-6),
    "film with slip": World(slip=5e-6),
    "adhesion that reaches": World(reach=1e-7),
    "creep in all decades": World(creeping=0.01),
    "plays that lag": World(lagging=5e-4),
    "converter that holds": World(held=4e4),
    "amplifier of one pole": World(pole=5e3),
    "amplifier with an offset": World(offset=0.1),
    "volts in the velocities": World(into_v=5e-4),
    "volts in the displacements": World(into_x=2e-7),
    "zeros that wander": World(wanders=1e-6),
    "coupled velocity": World(high_v=5.0),
    "sampling jitter": World(jitter=2e-6),
    "table that vibrates": World(table=3e-7),
    "gain of the velocities": World(speeds=1.01),
    "light of the tip at the centre": World(echo=0.01),
    "colder in the sweeps": World(warmer=5e-4),
    "spot that roams": World(roams=4e-6),
    "head that rings": World(rings=2e-8),
    "samples lost on the way": World(dropped=0.5),
    "clamp that creeps": World(relaxing=0.05, relaxes=0.3),
    "bending along the ground": World(sideways=0.03),
    "uneven film": World(uneven=0.4),
    "dust under the foot": World(dust=2e-6),
    "amplifier that sags": World(sag=0.05),
    "cables swapped in one file": World(swapped=True),
}
"""Kinds of world: one as the model has it, and differences from it, alone and two at once."""
