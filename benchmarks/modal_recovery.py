"""How well modes are recovered from structures that are not the model they are fitted by, and whether intervals hold.

Run ``python benchmarks/modal_recovery.py [--trials 12] [--held-out] [kind ...]``. Every kind of structure and
measurement is drawn ``trials`` times, at 5 to 60 dB in turn (`LEVELS`: noise below the root mean square of a channel),
and identified in its band. True poles are the eigenvalues of the structure's own equations of motion; a mode counts as
shown where its peak stands three times above the noise of some channel. Printed are, for each kind and each level, how
many of these were found and determined, errors, how often 95 % intervals hold the truth, and what was called determined
and is no mode, or the same mode twice. Exit code 1 where no mode was determined, or where fewer intervals of all hold
the truth than chance has it once in forty.

`DEVELOPED` holds the kinds that thresholds may be looked at with; `HELD_OUT` was left alone until these stood, and is
reported as it falls: nothing may be set by it.
"""

from __future__ import annotations

import argparse
import os
import sys
import time
from collections.abc import Callable, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from scipy.optimize import brentq
from scipy.signal import bessel, butter, lfilter, sosfilt
from scipy.stats import binomtest

import tarsus as ts
from tarsus.base.errors import InputError
from tarsus.modes import Frf, ModalFit, ModeVerdict, identify_modes
from tarsus.records.measurement import Channel, FrequencyResponse, Measurement, Quantity

LEVELS = (60.0, 40.0, 30.0, 20.0, 10.0, 5.0)
BAND = (100.0, 900.0)
LINES = np.arange(90.0, 910.0, 0.5)
RATE = 4096.0
Random = np.random.Generator
Array = np.ndarray


@dataclass(frozen=True)
class Structure:
    """Linear equations of motion of n coordinates, mass one each: damping and stiffness (n, n)."""

    damping: Array
    stiffness: Array

    @staticmethod
    def draw(
        random: Random, frequencies: Array, ratios: Array, local: float = 0.0, shapes: Array | None = None
    ) -> Structure:
        """Modes of given frequencies [Hz] and damping ratios, with orthogonal shapes that are drawn unless given; local
        dashpots between drawn coordinates multiply the damping by about ``1 + local``, and couple the modes."""
        n = len(frequencies)
        if shapes is None:
            shapes = np.linalg.qr(random.standard_normal((n, n)))[0]
        w = 2.0 * np.pi * frequencies
        damping = shapes * (2.0 * ratios * w) @ shapes.T
        for _ in range(2 if local else 0):
            a, b = random.choice(n, 2, replace=False)
            across = np.zeros(n)
            across[a], across[b] = 1.0, -1.0
            damping = damping + 0.5 * local * np.trace(damping) / 2.0 * np.outer(across, across)
        return Structure(damping, shapes * w**2 @ shapes.T)

    def system(self) -> tuple[Array, Array, Array]:
        """Eigenvalues (2n,) [rad/s], displacements of the eigenvectors (n, 2n), and how forces drive them (2n, n)."""
        n = len(self.stiffness)
        a = np.block([[np.zeros((n, n)), np.eye(n)], [-self.stiffness, -self.damping]])
        poles, vectors = np.linalg.eig(a)
        return poles, vectors[:n], np.linalg.inv(vectors)[:, n:]

    def poles(self, band: tuple[float, float] = BAND) -> Array:
        """Poles [rad/s] inside a band."""
        poles = self.system()[0]
        f = np.abs(poles) / (2.0 * np.pi)
        return np.sort_complex(poles[(poles.imag > 0.0) & (f > band[0] + 5.0) & (f < band[1] - 5.0)])

    def responses(self, frequency: Array, points: int, drive: int = 0) -> Array:
        """Velocities (points, nf) of the first coordinates per force at one [m/s/N]."""
        poles, vectors, driven = self.system()
        s = 2.0j * np.pi * frequency
        return (vectors[:points] * driven[:, drive]) @ (s / (s - poles[:, None]))


@dataclass(frozen=True)
class Case:
    """What was measured, and the truth.

    sources: for the verb, or one `Frf`; poles (nm,) [rad/s], shown (nm,): whether the noise leaves them to be seen.
    """

    sources: tuple[Any, ...]
    poles: Array
    shown: Array
    band: tuple[float, float] = BAND
    words: dict[str, Any] = field(default_factory=dict)

    def identified(self) -> ModalFit | None:
        """The modes found, None where the library finds none."""
        try:
            if isinstance(self.sources[0], Frf):
                return identify_modes(self.sources[0], self.band)
            return ts.modes(*self.sources, band=self.band, **self.words)
        except InputError as error:
            if "no mode was found" not in str(error):
                raise
            return None


def names(points: int) -> tuple[str, ...]:
    return tuple(f"p{k}" for k in range(1, points + 1))


def noise(random: Random, shape: tuple[int, ...], tilt: float = 0.0) -> Array:
    """Noise of unit variance along the last axis, whose power falls with frequency to the power of ``tilt``."""
    white = random.standard_normal(shape)
    if not tilt:
        return white
    spectrum = np.fft.rfft(white)
    spectrum[..., 1:] *= np.arange(1, spectrum.shape[-1]) ** (-0.5 * tilt)
    spectrum[..., 0] = 0.0
    coloured = np.fft.irfft(spectrum, shape[-1])
    return coloured / coloured.std(axis=-1, keepdims=True)


def shown_in(structure: Structure, poles: Array, level: Array, points: int, drive: int = 0) -> Array:
    """Which poles have a peak three times as high as the noise (points,) of some response."""
    every, vectors, driven = structure.system()
    k = np.array([np.argmin(np.abs(every - pole)) for pole in poles], dtype=int)
    peak = np.abs(vectors[:points, k] * driven[k, drive] * every[k]) / np.abs(every[k].real)
    return np.any(peak > 3.0 * np.reshape(level, (-1, 1)), axis=0)


def from_responses(random: Random, structure: Structure, decibels: float, points: int = 4, tilt: float = 0.0) -> Case:
    """Responses with noise on every line; its power changes with frequency by ``tilt``."""
    exact = structure.responses(LINES, points)
    level = 10.0 ** (-decibels / 20.0) * np.sqrt(np.mean(np.abs(exact) ** 2, axis=1, keepdims=True))
    parts = random.standard_normal((2, *exact.shape)) * (LINES / 400.0) ** (-0.5 * tilt) / np.sqrt(2.0)
    values = exact + level * (parts[0] + 1.0j * parts[1])
    frf = Frf(LINES, values[:, None], names(points), ("force",), Quantity.VELOCITY)
    poles = structure.poles()
    return Case((frf,), poles, shown_in(structure, poles, level, points))


def forced(structure: Structure, force: Array, points: int, cubic: float = 0.0) -> Array:
    """Velocities (points, ns) under a force of `RATE` at the first coordinate, at rest before, by Fourier transforms of
    twice its length; ``cubic`` [N/m^3] is a hardening spring there, solved by successive substitution."""
    count = 2 * len(force)
    s = 2.0j * np.pi * np.fft.rfftfreq(count, 1.0 / RATE)
    unit = structure.responses(np.fft.rfftfreq(count, 1.0 / RATE), points)
    to_displacement = np.divide(unit[0], s, out=np.zeros_like(unit[0]), where=np.abs(s) > 0.0)
    drive = np.fft.rfft(force, count)
    total = drive
    for _ in range(60 if cubic else 0):
        total = 0.5 * total + 0.5 * (drive - np.fft.rfft(cubic * np.fft.irfft(total * to_displacement, count) ** 3))
    return np.fft.irfft(total * unit, count)[:, : len(force)]


def record(force: Array, rows: Array, source: str = "record", rate: float = RATE) -> Measurement:
    channels = (Channel("force", Quantity.FORCE), *(Channel(n, Quantity.VELOCITY) for n in names(len(rows))))
    return Measurement(channels, np.vstack([force, rows]), 1.0 / rate, drive="force", source=source)


def noisy(random: Random, rows: Array, decibels: float, tilt: float = 0.0) -> Array:
    size = 10.0 ** (-decibels / 20.0) * rows.std(axis=-1, keepdims=True)
    return rows + size * noise(random, rows.shape, tilt)


def hardly(poles: Array, structure: Structure, decibels: float, points: int, averages: float) -> Array:
    """Poles shown by averaged records of broad-band motion: noise of the responses falls with the averages."""
    exact = structure.responses(LINES, points)
    level = np.sqrt(np.mean(np.abs(exact) ** 2, axis=1)) * 10.0 ** (-decibels / 20.0) / np.sqrt(averages)
    return shown_in(structure, poles, level, points)


def sweep(seconds: float) -> Array:
    """A linear sweep over the band and a little more, with rest behind it."""
    time_ = np.arange(int(seconds * RATE)) / RATE
    span = 0.8 * seconds
    phase = 2.0 * np.pi * (70.0 * time_ + 0.5 * (950.0 - 70.0) / span * time_**2)
    ramp = np.clip(time_ / (0.02 * span), 0.0, 1.0) * np.clip((span - time_) / (0.02 * span), 0.0, 1.0)
    return np.sin(phase) * ramp


def broad(random: Random, seconds: float) -> Array:
    """A random force below 0.27 of the sampling rate."""
    return sosfilt(butter(8, 0.54, output="sos"), random.standard_normal(int(seconds * RATE)))


def some(random: Random, count: int, low: float = 130.0, high: float = 850.0) -> tuple[Array, Array]:
    """Frequencies at least 4 % apart and damping ratios of 0.2 % to 2 %."""
    while True:
        f = np.sort(random.uniform(low, high, count))
        if np.all(np.diff(f) > 0.04 * f[:-1]):
            return f, 10.0 ** random.uniform(np.log10(0.002), np.log10(0.02), count)


# --- kinds that thresholds may be looked at with


def wide(random: Random, decibels: float, repeats: int = 1) -> Case:
    """Displacements of four modes at eight points, far apart in a band of 6700 lines; several repeats are averaged."""
    f = 200.0 * np.cumprod(np.append(random.uniform(1.0, 1.8), random.uniform(1.35, 2.3, size=3)))
    shapes = random.uniform(0.3, 1.0, size=(4, 8)) * random.choice([-1.0, 1.0], size=(4, 8)) * f[:, None]
    ratios, lines = random.uniform(0.005, 0.04, size=4), np.arange(100.0, 6800.0, 1.0)
    w, own = 2.0 * np.pi * lines, 2.0 * np.pi * f[:, None]
    curves = 1.0 / (own**2 - w**2 + 2.0j * ratios[:, None] * own * w)
    exact = np.einsum("mp,m,mf->pf", shapes, shapes[:, 0], curves)[:, None]
    level = 10.0 ** (-decibels / 20.0) * np.sqrt(np.mean(np.abs(exact) ** 2, axis=-1, keepdims=True) / 2.0)
    parts = random.standard_normal((2, repeats, *exact.shape))
    single = exact + level * (parts[0] + 1.0j * parts[1])
    frf = Frf(lines, single.mean(axis=0), names(8), ("p1",), Quantity.DISPLACEMENT, single if repeats > 1 else None)
    poles = own[:, 0] * (-ratios + 1.0j * np.sqrt(1.0 - ratios**2))
    peak = np.abs(shapes * shapes[:, :1]).T / (2.0 * ratios * own[:, 0] ** 2)
    return Case((frf,), poles, np.any(peak > 3.0 * level[:, 0], axis=0), (lines[0], lines[-1]))


def nonproportional(random: Random, decibels: float) -> Case:
    """Local dashpots double the damping and turn the shapes complex."""
    return from_responses(random, Structure.draw(random, *some(random, 6), local=1.0), decibels)


def weak(random: Random, decibels: float) -> Case:
    """A mode of a thirtieth beside a strong one, three to ten half-power bands away."""
    f, ratios = some(random, 5)
    f[2] = f[1] * (1.0 + 2.0 * ratios[1] * random.uniform(3.0, 10.0))
    ratios[2] = ratios[1]
    shapes = np.linalg.qr(random.standard_normal((5, 5)))[0]
    shapes[:, 2] *= np.sqrt(1.0 / 30.0)
    inverse = np.linalg.inv(shapes)
    w = 2.0 * np.pi * f
    own = Structure(shapes * (2.0 * ratios * w) @ inverse, shapes * w**2 @ inverse)
    return from_responses(random, own, decibels)


def windowed(random: Random, decibels: float) -> Case:
    """A random drive through Hann windows, whose lines are a fifth to one half-power band of the modes apart."""
    f, ratios = some(random, 5)
    own = Structure.draw(random, f, ratios.clip(0.004), local=0.3)
    force = broad(random, 41.0)
    rows = forced(own, force, 3)[:, int(RATE) :]
    poles = own.poles()
    source = record(noisy(random, force[int(RATE) :], decibels + 20.0), noisy(random, rows, decibels))
    return Case((source,), poles, hardly(poles, own, decibels, 3, 60.0), words={"segment": 1.0})


def cubic(random: Random, decibels: float) -> Case:
    """A hardening spring that shifts the strongest resonance by a tenth of its half-power band or so, under sweeps."""
    f, ratios = some(random, 4)
    own = Structure.draw(random, f, ratios.clip(0.003))
    force, poles = sweep(8.0), own.poles()
    linear = forced(own, force, 1)[0]
    shift = 0.2 * np.abs(poles.real).min() * np.abs(poles).min()
    amplitude = np.abs(linear).max() / np.abs(poles).min()
    rows = forced(own, force, 3, shift / (0.75 * amplitude**2))
    return Case((record(force, noisy(random, rows, decibels)),), poles, hardly(poles, own, decibels, 3, 1.0))


def hum(random: Random, decibels: float) -> Case:
    """Blows of a hammer, in repeats, with pink noise and the harmonics of the mains."""
    own = Structure.draw(random, *some(random, 5), local=0.5)
    poles, sources = own.poles(), []
    time_ = np.arange(int(2.0 * RATE)) / RATE
    for k in range(4):
        width = random.uniform(0.7e-3, 0.9e-3)
        force = np.where(time_ < width, np.sin(np.pi * time_ / width) ** 2, 0.0)
        rows = forced(own, force, 3)
        size = 10.0 ** (-decibels / 20.0) * rows.std(axis=1, keepdims=True)
        mains = sum(np.sin(2.0 * np.pi * 50.0 * n * time_ + random.uniform(0.0, 6.0)) / n for n in (1, 3, 5))
        rows = noisy(random, rows, decibels, 1.0) + 0.5 * size * mains
        sources.append(record(noisy(random, force, 60.0), rows, f"blow{k}"))
    return Case(tuple(sources), poles, hardly(poles, own, decibels, 3, 4.0))


def roving(random: Random, decibels: float) -> Case:
    """An accelerometer that is moved from file to file and loads each point: modes move by up to a half-power
    band. The truth is the mean of what the files hold."""
    f, ratios = some(random, 4)
    shapes = np.linalg.qr(random.standard_normal((4, 4)))[0]
    bare, points = Structure.draw(random, f, ratios, shapes=shapes), 4
    poles, sources = [], []
    mass = random.uniform(0.2, 1.0) * float(np.median(ratios)) * 2.0
    level = 10.0 ** (-decibels / 20.0)
    for k in range(points):
        with_mass = np.eye(4)
        with_mass[k, k] += mass
        root = np.linalg.inv(np.sqrt(with_mass))
        loaded = Structure(root @ bare.damping @ root, root @ bare.stiffness @ root)
        poles.append(loaded.poles())
        exact = loaded.responses(LINES, points)[k] * root[k, k] * root[0, 0]
        parts = random.standard_normal((2, len(LINES))) * level * np.sqrt(np.mean(np.abs(exact) ** 2) / 2.0)
        channel = Channel(names(points)[k], Quantity.VELOCITY, point=names(points)[k])
        values = (exact + parts[0] + 1.0j * parts[1])[None, None]
        sources.append(
            FrequencyResponse((channel,), (Channel("force", Quantity.FORCE),), LINES, values, None, f"file{k}")
        )
    size = level * np.sqrt(np.mean(np.abs(bare.responses(LINES, points)) ** 2, axis=1))
    mean = np.mean(poles, axis=0)
    return Case(tuple(sources), mean, shown_in(bare, mean, size, points))


def hysteretic(random: Random, decibels: float) -> Case:
    """Damping by a complex stiffness, the same at all frequencies, and noise that grows with frequency."""
    f, ratios = some(random, 6)
    shapes = np.linalg.qr(random.standard_normal((6, 6)))[0]
    w, s = 2.0 * np.pi * f, 2.0j * np.pi * LINES
    curves = s / (w[:, None] ** 2 * (1.0 + 2.0j * ratios[:, None]) + s**2)
    exact = (shapes[:4] * shapes[0]) @ curves
    level = 10.0 ** (-decibels / 20.0) * np.sqrt(np.mean(np.abs(exact) ** 2, axis=1, keepdims=True))
    parts = random.standard_normal((2, *exact.shape)) * (LINES / 400.0) ** 0.5 / np.sqrt(2.0)
    values = exact + level * (parts[0] + 1.0j * parts[1])
    frf = Frf(LINES, values[:, None], names(4), ("force",), Quantity.VELOCITY)
    poles = 1.0j * w * np.sqrt(1.0 + 2.0j * ratios)  # of the response itself, whose mirrored pole is no conjugate
    viscous = Structure.draw(random, f, ratios, shapes=shapes)
    return Case((frf,), poles, shown_in(viscous, poles, level, 4))


def decay(random: Random, decibels: float) -> Case:
    """A free decay with zeros off and noise that falls with frequency."""
    own = Structure.draw(random, *some(random, 4), local=0.5)
    poles, vectors, _ = own.system()
    time_ = np.arange(int(1.0 * RATE)) / RATE
    up = poles.imag > 0.0
    size = np.exp(2.0j * np.pi * random.random(int(up.sum()))) * random.uniform(0.3, 1.0, int(up.sum()))
    rows = 2.0 * np.real((vectors[:3, up] * poles[up] * size) @ np.exp(poles[up, None] * time_))
    rows = noisy(random, rows, decibels, 1.0) + rows.std() * random.normal(0.0, 0.1, (3, 1))
    channels = tuple(Channel(n, Quantity.VELOCITY) for n in names(3))
    inside, seen = own.poles(), hardly(own.poles(), own, decibels, 3, 1.0)
    return Case((Measurement(channels, rows, 1.0 / RATE, source="decay"),), inside, seen, words={"decay": True})


DEVELOPED = (wide, nonproportional, weak, windowed, cubic, hum, roving, hysteretic, decay)


# --- kinds that nothing may be set by


def close(random: Random, decibels: float) -> Case:
    """Pairs of modes half a half-power band to two apart, as of a nearly round plate, with local dashpots."""
    f, ratios = some(random, 3)
    apart = 1.0 + 2.0 * ratios * random.uniform(0.5, 2.0, 3)
    both = np.sort(np.concatenate([f, f * apart]))
    return from_responses(random, Structure.draw(random, both, np.repeat(ratios, 2), 0.3), decibels)


def outside(random: Random, decibels: float) -> Case:
    """Strong modes just below and above the band and twelve farther ones, with few modes inside."""
    f, ratios = some(random, 4, 250.0, 750.0)
    low, high = random.uniform(82.0, 97.0), random.uniform(903.0, 960.0)
    beyond = random.uniform(1000.0, 6000.0, 11)
    every = np.concatenate([[random.uniform(10.0, 40.0), low], f, [high], beyond])
    damping = np.concatenate([[0.01, 0.008], ratios, [0.008], np.full(11, 0.01)])
    own = Structure.draw(random, every, damping, 0.2)
    return from_responses(random, own, decibels)


def dropout(random: Random, decibels: float) -> Case:
    """A shaker whose force drops out at the resonances, with noise in the force too."""
    f, ratios = some(random, 5)
    own = Structure.draw(random, f, ratios, local=0.3)
    current = broad(random, 61.0)
    lines = np.fft.rfftfreq(2 * len(current), 1.0 / RATE)
    at_drive = own.responses(lines, 1)[0]
    peak = np.abs(at_drive).max()
    # the coil's own mass and back-EMF take the force where the structure moves most: a fall to a tenth at the peak
    spectrum = np.fft.rfft(current, 2 * len(current)) / (1.0 + 9.0 * at_drive / peak)
    force = np.fft.irfft(spectrum)[: len(current)]
    rows = forced(own, force, 3)[:, int(RATE) :]
    source = record(noisy(random, force[int(RATE) :], decibels), noisy(random, rows, decibels))
    poles = own.poles()
    return Case((source,), poles, hardly(poles, own, decibels, 3, 25.0), words={"segment": 4.0})


def jitter(random: Random, decibels: float) -> Case:
    """Sweeps whose samples are late by a part of a step at random, on a clock that drifts by 50 ppm."""
    own = Structure.draw(random, *some(random, 5), local=0.3)
    force, poles = sweep(8.0), own.poles()
    rows = np.vstack([force, forced(own, force, 3)])
    spectrum = np.fft.rfft(rows, 2 * rows.shape[1])
    rate = 2.0j * np.pi * np.fft.rfftfreq(2 * rows.shape[1], 1.0 / RATE)
    slope, bend = (np.fft.irfft(spectrum * rate**n)[:, : rows.shape[1]] for n in (1, 2))
    at = np.arange(rows.shape[1]) / RATE
    late = 0.1 / RATE * random.standard_normal(rows.shape[1]) + 50e-6 * (at - at.mean()) * 0.02
    rows = rows + slope * late + 0.5 * bend * late**2
    seen = hardly(poles, own, decibels, 3, 1.0)
    return Case((record(rows[0], noisy(random, rows[1:], decibels)),), poles, seen)


def beating(random: Random, decibels: float) -> Case:
    """Free decays of pairs of close modes, in two records, released differently."""
    f, ratios = some(random, 2)
    apart = 1.0 + 2.0 * ratios * random.uniform(1.0, 3.0, 2)
    own = Structure.draw(random, np.concatenate([f, f * apart]), np.tile(ratios, 2))
    poles, vectors, _ = own.system()
    time_, up, sources = np.arange(int(1.5 * RATE)) / RATE, poles.imag > 0.0, []
    for k in range(2):
        turned = np.exp(2.0j * np.pi * random.random(int(up.sum()))) * random.uniform(0.3, 1.0, int(up.sum()))
        rows = 2.0 * np.real((vectors[:3, up] * poles[up] * turned) @ np.exp(poles[up, None] * time_))
        channels = tuple(Channel(n, Quantity.VELOCITY) for n in names(3))
        sources.append(Measurement(channels, noisy(random, rows, decibels), 1.0 / RATE, source=f"decay{k}"))
    inside = own.poles()
    return Case(tuple(sources), inside, hardly(inside, own, decibels, 3, 2.0), words={"decay": True})


def beam(random: Random, decibels: float) -> Case:
    """A clamped beam as a continuum, thirty modes of it, of which those beyond the band are only felt."""
    roots = [
        brentq(lambda x: np.cos(x) + 1.0 / np.cosh(x), (k + 0.5) * np.pi - 0.4, (k + 0.5) * np.pi + 0.4)
        for k in range(30)
    ]
    beta = np.array(roots)
    places = random.uniform(0.3, 1.0, 4)[:, None]
    ends = (np.cosh(beta) + np.cos(beta)) / (np.sinh(beta) + np.sin(beta))
    ends = np.where(beta > 15.0, 1.0, ends)
    x = beta * places
    grown = np.where(x > 15.0, 0.0, np.cosh(np.minimum(x, 15.0)) - ends * np.sinh(np.minimum(x, 15.0)))
    shapes = grown - np.cos(x) + ends * np.sin(x)
    w = 2.0 * np.pi * random.uniform(8.0, 25.0) * (beta / beta[0]) ** 2
    ratios = random.uniform(0.002, 0.01) * np.ones(30)
    s = 2.0j * np.pi * LINES
    curves = s / (w[:, None] ** 2 + 2.0 * (ratios * w)[:, None] * s + s**2)
    exact = (shapes * shapes[0]) @ curves
    level = 10.0 ** (-decibels / 20.0) * np.sqrt(np.mean(np.abs(exact) ** 2, axis=1, keepdims=True))
    parts = random.standard_normal((2, *exact.shape)) / np.sqrt(2.0)
    values = exact + level * (parts[0] + 1.0j * parts[1])
    f = w / (2.0 * np.pi)
    inside = (f > BAND[0] + 5.0) & (f < BAND[1] - 5.0)
    peak = np.abs(shapes * shapes[0])[:, inside] / (2.0 * (ratios * w)[inside])
    poles = (w * (-ratios + 1.0j * np.sqrt(1.0 - ratios**2)))[inside]
    frf = Frf(LINES, values[:, None], names(4), ("force",), Quantity.VELOCITY)
    return Case((frf,), poles, np.any(peak > 3.0 * level, axis=0))


def coarse(random: Random, decibels: float) -> Case:
    """Sweeps through a converter of ten bits, a third of whose range is used."""
    own = Structure.draw(random, *some(random, 5), local=0.3)
    force, poles = sweep(8.0), own.poles()
    rows = noisy(random, np.vstack([force, forced(own, force, 3)]), decibels)
    rows[0] = force
    digit = 3.0 * np.abs(rows).max(axis=1, keepdims=True) / 512.0
    rows = np.round(rows / digit) * digit
    return Case((record(rows[0], rows[1:]),), poles, hardly(poles, own, min(decibels, 30.0), 3, 1.0))


def lagging(random: Random, decibels: float) -> Case:
    """Sweeps whose motion comes late, through an instrument of two poles, and noise of an amplifier's corner."""
    own = Structure.draw(random, *some(random, 5), local=0.3)
    force, poles = sweep(8.0), own.poles()
    b, a = bessel(2, 0.8)
    rows = lfilter(b, a, forced(own, force, 3), axis=1)
    rows = np.roll(rows, random.integers(0, 2), axis=1)
    source = record(force, noisy(random, rows, decibels, 0.5))
    return Case((source,), poles, hardly(poles, own, decibels, 3, 1.0))


HELD_OUT = (close, outside, dropout, jitter, beating, beam, coarse, lagging)

Kind = Callable[[Random, float], Case]


@dataclass(frozen=True)
class Score:
    """Over modes that were shown, nan where one was not found: relative errors (nm,) of frequency and damping ratio,
    whether their intervals hold the truth, and whether the mode is determined; extra and double: modes called
    determined that are none, or one that is found already."""

    frequency: Array
    damping: Array
    frequency_held: Array
    damping_held: Array
    determined: Array
    extra: int = 0
    double: int = 0

    @staticmethod
    def joined(parts: Sequence[Score]) -> Score:
        arrays = (
            np.concatenate([getattr(one, name) for one in parts])
            for name in ("frequency", "damping", "frequency_held", "damping_held", "determined")
        )
        return Score(*arrays, sum(one.extra for one in parts), sum(one.double for one in parts))

    def intervals(self) -> tuple[str, bool]:
        """How many 95 % intervals of determined modes hold the truth, and whether that is as often as they say."""
        sure = self.determined > 0.0
        held = np.concatenate([self.frequency_held[sure], self.damping_held[sure]])
        said = f"{int(held.sum())} of {len(held)} intervals of determined modes hold"
        return said, len(held) > 0 and binomtest(int(held.sum()), len(held)).proportion_ci(0.95).high >= 0.95

    def line(self) -> str:
        """The figures: shares in percent, errors of what is determined."""
        found, sure = np.isfinite(self.frequency), self.determined > 0.0
        f, zeta = np.abs(self.frequency[sure]), self.damping[sure]

        def share(of: Array) -> str:
            return f"{100.0 * np.mean(of):4.0f}" if len(of) else "   -"

        bias = f"{100.0 * np.median(zeta):+6.2f}" if len(zeta) else "     -"
        return (
            f"{len(found):5d} {share(found)} {share(sure)}   {share(f < 1e-3)} {share(np.abs(zeta) < 0.1)} {bias}   "
            f"{share(self.frequency_held[sure])} {share(self.damping_held[sure])}   {self.extra:3d} {self.double:3d}"
        )


HEAD = " " * 25 + "shown found sure   f 0.1% zeta 10% bias   intervals f zeta   extra double\n" + " " * 25 + "%"


def scored(case: Case, fit: ModalFit | None) -> Score:
    """Every true mode against the nearest of those found within its half-power band, determined ones first."""
    modes = sorted(fit.modes if fit else (), key=lambda m: m.verdict is not ModeVerdict.DETERMINED)
    sure = [m.verdict is ModeVerdict.DETERMINED for m in modes]
    table = np.full((len(case.poles), 5), np.nan)
    table[:, 4] = 0.0
    taken: set[int] = set()
    double = extra = 0
    for mode, good in zip(modes, sure, strict=True):
        apart = np.abs(case.poles - mode.pole) / (2.0 * np.abs(case.poles.real))
        near = [k for k in np.argsort(apart) if apart[k] < 1.0]
        free = [k for k in near if k not in taken]
        if not free:
            double += good and bool(near)
            extra += good and not near
            continue
        k = free[0]
        taken.add(k)
        f, ratio = np.abs(case.poles[k]) / (2.0 * np.pi), -case.poles[k].real / np.abs(case.poles[k])
        a, b = mode.frequency, mode.damping
        table[k] = (a.value / f - 1.0, b.value / ratio - 1.0, a.low <= f <= a.high, b.low <= ratio <= b.high, good)
    return Score(*table[case.shown].T, extra, double)


def trial(kind: Kind, number: int) -> Score:
    """One drawn structure, at the level whose turn it is."""
    seed = sum(ord(letter) * 31**place for place, letter in enumerate(kind.__name__)) % 2**32
    random = np.random.default_rng([seed, number])
    case = kind(random, LEVELS[number % len(LEVELS)])
    return scored(case, case.identified())


def _trial(job: tuple[str, int]) -> Score:
    return trial(KINDS[job[0]], job[1])


KINDS: dict[str, Kind] = {kind.__name__: kind for kind in (*DEVELOPED, *HELD_OUT)}


def main(arguments: list[str]) -> int:
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("kinds", nargs="*", choices=[*KINDS, []])
    parser.add_argument("--trials", type=int, default=12)
    parser.add_argument("--held-out", action="store_true")
    parser.add_argument("--jobs", type=int, default=1)
    chosen = parser.parse_args(arguments)
    kinds = chosen.kinds or [kind.__name__ for kind in (HELD_OUT if chosen.held_out else DEVELOPED)]
    jobs = [(kind, k) for kind in kinds for k in range(chosen.trials)]
    began = time.perf_counter()
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    with ProcessPoolExecutor(chosen.jobs) as pool:
        scores = list(pool.map(_trial, jobs))
    print(HEAD)
    for kind in kinds:
        own = [score for (name, _), score in zip(jobs, scores, strict=True) if name == kind]
        print(f"{kind:25s}{Score.joined(own).line()}")
    for k, level in enumerate(LEVELS):
        own = [score for (_, n), score in zip(jobs, scores, strict=True) if n % len(LEVELS) == k]
        if own:
            print(f"{level:4.0f} dB{'':18s}{Score.joined(own).line()}")
    together = Score.joined(scores)
    print(f"{'all':25s}{together.line()}")
    said, sound = together.intervals()
    print(f"{said}\n{time.perf_counter() - began:.0f} s")
    return int(not sound)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
