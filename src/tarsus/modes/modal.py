"""Modes of a structure from its frequency responses: poles, refinement, shapes, intervals and a verdict on each."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from tarsus.base.arrays import Complexes, Floats
from tarsus.base.errors import InputError
from tarsus.base.messages import some_of
from tarsus.base.spec import scene_name
from tarsus.base.threads import single_threaded
from tarsus.fit.ranges import Range
from tarsus.formats.freedoms import along_axis
from tarsus.measure.mac import mac
from tarsus.model.structure.modal import Modal
from tarsus.modes.frf import Frf
from tarsus.modes.gather import merged
from tarsus.modes.intervals import pole_ranges, scatter_of
from tarsus.modes.lscf import fit_poles
from tarsus.modes.lsfd import residues_of, synthesise
from tarsus.modes.mode import IdentifiedMode, ModeVerdict, judged_together, mode_of, strength_of
from tarsus.modes.pole_search import PoleCandidate, candidate_poles, poles_of_parts, reach
from tarsus.modes.refine import LocalFit, Surroundings, refine_pole
from tarsus.modes.spread import spreads
from tarsus.records.measurement import FrequencyResponse
from tarsus.tables.table import Column, Table, Tabled

_SIGNIFICANT = 5.0
"""Standard deviations that a residue must have: of a million poles of noise one does."""
_ROUNDS = 2
"""Times that all poles are refined with all others known; the second sees neighbours that are refined themselves."""
_SAME = 0.3
"""Half-power bandwidths within which two poles are one: the responses of closer modes do not distinguish them."""
_APART = 6.0
"""Half-power bandwidths from known modes at which a part of the band may add one: nearer, its poles mend the fit of
those."""
MOST_ORDER = 300
"""Largest order of a model: the work grows as its fourth power, to minutes here, and a band of 100 modes is better cut
into parts."""
_EXPLAINED = 0.1
"""Part of what one pole leaves that two may leave for these to be two modes: simulated pairs taken for one leave 0.01
to 0.03 where that puts the damping a fifth off, and second poles in measured responses of one mode 0.11 or more."""
_HOPELESS = 0.5
"""Part of it above which a first round of weights is the last: the others take off a few percent."""
_STEADY = 0.5
"""Part of the orders that must have a pole for it to be taken for a neighbour beforehand."""
_DAMPING_MOVES = 1.5
"""Bandwidths by which a refined pole may change its damping, which first models find too large."""
_SMEARED = 0.01
"""Half-power band, in lines, below which a pole seen through windows has no damping: a hundredth of their width."""
_UNEXPLAINED = 0.3
"""Part of the responses unexplained from which on it is remarked: a mode is missing or the model is wrong."""

_COARSE = 1e-5
"""Share of all frequencies from which on the rounding of sampling steps is remarked: intervals are seldom narrower."""


@dataclass(frozen=True, repr=False)
class ModalFit(Tabled):
    """Modes identified in a band.

    frf: the responses of the band; modes: by frequency, refused ones included; poles: of all models by order [rad/s],
    for a stabilisation diagram; synthesis (no, ni, nf): responses of all modes and of a background of second degree;
    delay [s] of the responses that all modes show.
    """

    frf: Frf
    modes: tuple[IdentifiedMode, ...]
    poles: dict[int, Complexes]
    synthesis: Complexes
    delay: float = 0.0

    def write(self, folder: str | os.PathLike[str]) -> Path:
        """Write modes.json, modes.csv and shapes.unv into a folder, which is made if it is not there, and returned.

        Raises InputError where it cannot be written.
        """
        from tarsus.modes.writing import write_modes

        write_modes(self, Path(folder))
        return Path(folder)

    def table(self) -> Table:
        """Every mode with its intervals and its verdict; below it what was remarked and refused."""
        rows = [
            (f.value, (f.low, f.high), zeta.value, (zeta.low, zeta.high), mode.orders, mode.verdict.value)
            for mode in self.modes
            for f, zeta in [(mode.frequency, mode.damping)]
        ]
        columns = [
            Column(name, unit, digits, over=over)
            for over, unit, digits in (("frequency", "Hz", 6), ("damping ratio", "%", 4))
            for name in ("value", "95 % interval")
        ]
        return Table("", (*columns, "orders", "verdict"), rows, (*self.remarks, *self.refused))

    @property
    def frequencies(self) -> Floats:
        """Undamped natural frequencies (nm,) [Hz]."""
        return np.array([mode.frequency.value for mode in self.modes])

    @property
    def damping_ratios(self) -> Floats:
        """Damping ratios (nm,) [1]."""
        return np.array([mode.damping.value for mode in self.modes])

    @property
    def refused(self) -> tuple[str, ...]:
        """A sentence for every mode that is not determined."""
        return tuple(mode.reason for mode in self.modes if mode.verdict is not ModeVerdict.DETERMINED)

    @property
    def remarks(self) -> tuple[str, ...]:
        """A sentence for responses that the modes leave unexplained, one for a delay, and one for rounded steps."""
        left = [
            f"the modes found leave {100.0 * self.misfit:.0f} % of the responses unexplained: some are missing; raise "
            "the order or narrow the band"
        ] * (self.misfit > _UNEXPLAINED)
        late = [
            f"the modes show that the responses come {abs(1e3 * self.delay):.3g} ms "
            f"{'after' if self.delay > 0.0 else 'before'} the drive, as by a delay of an instrument: corrected"
        ] * (self.delay != 0.0)
        few = [
            "sampling steps are written in few digits: all frequencies may be wrong together by "
            f"{100.0 * self.frf.rounding:.2g} %, which their intervals hold"
        ] * (self.frf.rounding > _COARSE)
        return (*left, *late, *few)

    @property
    def misfit(self) -> float:
        """Root mean square of responses less synthesis over that of the responses, over the band."""
        left, whole = np.abs(self.frf.values - self.synthesis) ** 2, np.abs(self.frf.values) ** 2
        return float(np.sqrt(left.sum() / whole.sum()))

    def only(self, near: Sequence[float]) -> ModalFit:
        """The same with the modes nearest to given frequencies [Hz] only; the synthesis stays."""
        picked = sorted({int(np.argmin(np.abs(self.frequencies - f))) for f in near})
        return replace(self, modes=tuple(self.modes[k] for k in picked))

    def complex_shapes(self) -> Complexes:
        """Complex shapes (nm, no) of the modes at the outputs: their strongest residues, turned and scaled so that the
        largest value is 1."""
        out = []
        for mode in self.modes:
            left = np.linalg.svd(mode.residues, full_matrices=False)[0][:, 0]
            out.append(left / left[np.argmax(np.abs(left))])
        return np.array(out)

    def mac(self) -> Floats:
        """Modal assurance criterion (nm, nm) of the modes with each other: 1 on the diagonal."""
        shapes = self.complex_shapes().T
        return mac(shapes, shapes)

    def shapes(self) -> tuple[Floats, Floats]:
        """Real shapes (nm, no) of the modes at the outputs, and their participations (nm, ni) in the inputs.

        The residues of every mode are turned by its `tilt` first. Modal masses are 1 kg. Where an input has the name of
        an output, it is taken as a force at that point and the shapes are mass-normalised. Elsewhere the responses do
        not show the mass: the largest shape value is 1, and the participation is the modal force on 1 kg per unit of
        input.
        """
        shapes, participations = [], []
        for mode in self.modes:
            gain = (2.0j * mode.pole.imag * mode.residues * np.exp(-1.0j * mode.tilt)).real
            left, size, right = np.linalg.svd(gain, full_matrices=False)
            shape, pull = left[:, 0], size[0] * right[0]
            driven = [
                (self.frf.outputs.index(name), k) for k, name in enumerate(self.frf.inputs) if name in self.frf.outputs
            ]
            scale = shape[np.argmax(np.abs(shape))]
            if driven:
                o, k = max(driven, key=lambda pair: abs(shape[pair[0]] * pull[pair[1]]))
                if shape[o] * pull[k] > 0.0:
                    scale = np.sign(scale) * np.sqrt(shape[o] / pull[k])
            shapes.append(shape / scale)
            participations.append(pull * scale)
        return np.array(shapes), np.array(participations)

    def structure(self) -> Modal:
        """The modes as a structure with the outputs as its points, by names that scenes allow (`scene_name`), and of
        degrees of freedom along their positive axes; modal masses 1 kg, scaled as `shapes` says.

        Raises
        ------
        InputError
            With the reason of every mode that is not determined, and for outputs that become one point. `only` leaves
            modes out.
        """
        if self.refused:
            raise InputError(self.refused)
        points: dict[str, tuple[float, ...]] = {}
        for name, shape in zip(self.frf.outputs, self.shapes()[0].T, strict=True):
            along, sign = along_axis(name)
            point = scene_name(along)
            if point in points:
                raise InputError(f"two of the outputs {', '.join(self.frf.outputs)} are one point: {point}")
            points[point] = tuple(map(float, sign * shape))
        return Modal(
            frequencies=tuple(map(float, self.frequencies)),
            damping_ratios=tuple(map(float, self.damping_ratios)),
            modal_masses=(1.0,) * len(self.modes),
            shapes=points,
        )


@single_threaded
def identify_modes(
    frf: Frf | FrequencyResponse,
    band: tuple[float, float],
    order: int = 40,
    smallest: float = 0.5,
    *,
    between_fits: bool = True,
    near: ModalFit | None = None,
) -> ModalFit:
    """Modes in a band of frequency responses.

    Poles that models of order 2 to ``order`` have in common (`candidate_poles`) are refined one by one, strongest
    first, then those of parts of the band (`poles_of_parts`) that lie three half-power bands from the modes found so
    far, and then all once more (`refine_pole`). A pole is kept if it moves by less than half a half-power band, or a
    line, and stands out of the noise.

    Parameters
    ----------
    frf
        Responses, as read from a file or estimated from records; several, such as repeats, by `merged`.
    band
        Lowest and highest frequency [Hz]; modes at the very edges are not sought.
    order
        Largest order of the models: two or three times the number of modes expected, and more where noise is high.
    smallest
        Share of the response that a mode must make up near its own frequency, in at least one channel.
    between_fits
        Whether intervals hold the spread between orders, windows and methods. Not where the structure is known to have
        just these modes: models of other orders are no other descriptions of it then.
    near
        A fit of nearly these responses: its poles are refined, strongest first, and no others are looked for.

    Returns
    -------
    ModalFit
        With a verdict on every mode.

    Raises
    ------
    InputError
        If no mode is found in the band, or it has too few lines; for an order below 2 or above `MOST_ORDER`.
    """
    if not 2 <= order <= MOST_ORDER:
        raise InputError(f"order: expected a number from 2 to {MOST_ORDER}, got {order}")
    if isinstance(frf, FrequencyResponse):  # a line next to 0 Hz may be off the grid of the others
        frf = merged([frf.between(max(band[0], 0.5 * float(np.median(np.diff(frf.frequency)))), band[1])])
    given = frf.between(*band)
    part, back = _by_size(given)
    count = len(part.frequency)
    top = min(order, count // 4)
    if top < 2:
        raise InputError(f"the band has {count} lines, too few to find a mode: 8 or more are needed")
    channels = part.values.reshape(-1, count)
    if not np.any(channels):
        raise InputError("all responses are zero in the band")
    real = [name for name, row in zip(part.outputs, part.values, strict=True) if not np.any(row.imag)]
    if part.forced and real:
        raise InputError(
            f"the responses of {some_of(real)} are real numbers throughout, without phases: modes are "
            "found in complex responses; export real and imaginary parts, or amplitudes and phases"
        )
    orders = range(2, top + 1)
    if near is None:
        poles = fit_poles(part.frequency, part.values, orders)
        candidates, more = candidate_poles(part, poles, smallest), poles_of_parts(part, smallest)
    else:
        found = [PoleCandidate(m.pole, m.orders, strength_of(m, part)) for m in near.modes]
        poles, candidates, more = near.poles, sorted(found, key=lambda one: -one.strength), []
    steady = [one.pole for one in candidates if one.pole.real < 0.0 and one.orders >= _STEADY * len(orders)]
    models = poles if near is None else {}
    kept = _refined(part, channels, [one.pole for one in candidates], [one.pole for one in more], steady, models)
    seen = {one.pole: one.orders for one in (*more, *candidates)}
    if not kept:
        raise InputError(
            f"no mode was found between {band[0]:g} Hz and {band[1]:g} Hz: no pole is common to models of different "
            "order and stands out of the noise; look at the coherence, or average more"
        )
    refined = np.array([fit.pole for fit in kept.values()])
    residues, background = residues_of(part.frequency, channels, refined, hann=part.hann)
    synthesis = (synthesise(part.frequency, refined, residues, part.hann) + background).reshape(part.values.shape)
    between = spreads(part, poles, synthesis, tuple(kept.values())) if between_fits else [None] * len(kept)
    modes = [mode_of(part, fit, seen.get(pole, 0), one) for (pole, fit), one in zip(kept.items(), between, strict=True)]
    judged, delay = judged_together(modes, part)
    judged = tuple(
        replace(mode, residues=mode.residues[back], frequency=_stretched(mode.frequency, frf.rounding))
        for mode in judged
    )
    return ModalFit(given, judged, poles, synthesis[back], delay=delay)


def _stretched(frequency: Range, share: float) -> Range:
    """The range of a frequency that may also be wrong by a share, which is a bound."""
    more = abs(frequency.value) * share
    return replace(frequency, low=frequency.low - more, high=frequency.high + more)


def _by_size(frf: Frf) -> tuple[Frf, tuple[NDArray[np.intp], NDArray[np.intp]]]:
    """The same with points and drives in the order of their size, and how to put them back: so that what is found
    depends on the order they were given in by no digit."""
    size = np.linalg.norm(frf.values, axis=-1)
    outputs, inputs = np.argsort(np.linalg.norm(size, axis=1)), np.argsort(np.linalg.norm(size, axis=0))
    at = np.ix_(outputs, inputs)
    arranged = replace(
        frf,
        values=frf.values[at],
        outputs=tuple(frf.outputs[o] for o in outputs),
        inputs=tuple(frf.inputs[i] for i in inputs),
        repeats=None if frf.repeats is None else frf.repeats[:, outputs][:, :, inputs],
        coherence=None if frf.coherence is None else frf.coherence[outputs],
        files=tuple(frf.files[o] for o in outputs) if frf.files else (),
    )
    return arranged, (np.argsort(outputs)[:, None], np.argsort(inputs)[None])


def _refined(
    frf: Frf,
    channels: Complexes,
    poles: Sequence[complex],
    more: Sequence[complex],
    steady: Sequence[complex],
    models: Mapping[int, Complexes],
) -> dict[complex, LocalFit]:
    """Local fits by the pole they began at, in order of frequency.

    Poles come strongest first, and then ``more``, as far as these lie three half-power bands from the modes found.

    A pole sees those before it as neighbours, and those to come that are ``steady`` unless they lead it astray; then
    all, except those whose damping is uncertain by half or more and that are not the strongest; where neighbours lead
    it astray, it stays as it was. Where one pole stands for two, which ``models`` of the band have, the second joins,
    and all are refined again; without models none is looked for.
    """
    frequency, line, window = frf.frequency, frf.line, Surroundings(hann=frf.hann)

    def refined(
        start: complex, others: Complexes, residues: Complexes | None = None, most: float = np.inf
    ) -> LocalFit | None:
        fit = refine_pole(frequency, channels, start, others, residues, window, most)
        if fit is None or fit.significance < _SIGNIFICANT:
            return None
        if frf.hann and abs(fit.pole.real) < _SMEARED * np.pi * line:
            return None  # a tone, which the window makes three lines wide
        moved, own = fit.pole - start, max(abs(start.real), 2.0 * np.pi * line)
        return fit if abs(moved.imag) <= own and abs(moved.real) <= _DAMPING_MOVES * own else None

    fits: dict[complex, LocalFit] = {}
    certain: list[complex] = []
    known, tried = set(poles), set[complex]()
    for pole in (*poles, *more):
        away = _APART * reach(pole, line)
        if pole not in known and any(abs(pole - other.pole) <= away for other in fits.values()):
            continue
        before = [fits[p].pole for p in certain]
        coming = [p for p in steady if p != pole and p not in tried]
        tried.add(pole)
        fit = refined(pole, np.array([*before, *coming])) if coming else None
        fit = fit or refined(pole, np.array(before, dtype=complex))
        if fit is None:
            continue
        fits[pole] = fit
        if not certain or _certain(fit, line):
            certain.append(pole)

    def all_refined() -> None:
        for _ in range(_ROUNDS):
            ends = np.array([fits[pole].pole for pole in certain])
            residues, _ = residues_of(frequency, channels, ends, hann=frf.hann)
            for pole, fit in list(fits.items()):
                others = np.array([p != pole for p in certain])
                fits[pole] = refined(fit.pole, ends[others], residues[:, others]) or fit

    all_refined()
    seconds = [_second(fits, pole, refined) for pole in certain if _unexplained(fits[pole], frf)] if models else []
    seconds = [one for one in seconds if one is not None and _shown(one.pole, models, line) and _certain(one, line)]
    if seconds:
        fits |= {one.pole: one for one in seconds}
        certain += [one.pole for one in seconds]
        all_refined()
    apart: dict[complex, LocalFit] = {}
    for pole, fit in fits.items():
        if all(abs(fit.pole - other.pole) > _SAME * abs(fit.pole.real) for other in apart.values()):
            apart[pole] = fit
    return dict(sorted(apart.items(), key=lambda item: item[1].pole.imag))


def _certain(fit: LocalFit, line: float) -> bool:
    """Whether the damping of a local fit is known to a half to either side."""
    damping = pole_ranges(fit.pole, scatter_of(fit, None, line)[0])[1]
    return damping.high - damping.low < abs(damping.value)


def _second(
    fits: Mapping[complex, LocalFit], pole: complex, refined: Callable[..., LocalFit | None]
) -> LocalFit | None:
    """The fit of a second pole close to one that stands for two, as of beating modes, or None.

    It is sought from half a half-power band to either side, and taken where the two leave much less than the one.
    """
    one, ends = fits[pole], np.array([fit.pole for fit in fits.values()])
    most = _HOPELESS * _left(one)
    found = [refined(one.pole + way * abs(one.pole.real), ends, most=most) for way in (1.0j, -1.0j)]
    left = [(_left(fit) / _left(one), fit) for fit in found if fit is not None and fit.pole.real < 0.0]
    part, best = min(left, key=lambda pair: pair[0], default=(1.0, None))
    return best if part < _EXPLAINED else None


def _unexplained(fit: LocalFit, frf: Frf) -> bool:
    """Whether a fit leaves more of the responses than by their scatter between repeats any other can do without."""
    if frf.repeats is None:
        return True
    part = frf.repeats[..., fit.lines].reshape(len(frf.repeats), len(fit.noise), -1)
    scatter = np.sqrt(np.mean(part.var(axis=0, ddof=1), axis=1) / (2.0 * len(part)))
    return float(np.exp(np.mean(np.log(np.maximum(scatter, 1e-300) / fit.noise)))) < _HOPELESS


def _left(fit: LocalFit) -> float:
    """What a fit leaves of the responses: the geometric mean over channels, so that their units do not count."""
    return float(np.exp(np.mean(np.log(fit.noise))))


def _shown(pole: complex, models: Mapping[int, Complexes], line: float) -> bool:
    """Whether half of the models of the upper orders have a pole."""
    upper = [models[order] for order in sorted(models)[len(models) // 2 :]]
    shown = [np.min(np.abs(poles - pole), initial=np.inf) < reach(pole, line) for poles in upper]
    return bool(np.mean(shown) >= _STEADY)
