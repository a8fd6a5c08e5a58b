"""Rebuild the quadruped's model from its printed digits, and say how far they determine it.

    python examples/rebuild_quadruped.py [--starts 60] [--chains 128] [--steps 3000] [--write FILE.toml]

The printed matrices of the quadruped (appendix B) are not positive definite: three digits lose the small eigenvalues
(erratum E9). What the source says about its model is more than those digits, though: damping is modal (3.1), the
frequencies are those of Table 3.3, and every mode is a resonance, so that its damping ratio is below one. A model of
that kind is

    M = A^T A,   C = A^T diag(2 zeta omega) A,   K = A^T diag(omega^2) A,   0 < zeta < 1,

with mass-normalised shapes A^-1, and many such models have every entry within half a unit of the last printed digit.
This script finds them from random starts (least squares, first to the entries, then to their rounding), moves each to
the next analytic centre, the model that is farthest from every bound in the sense of

    minimise  - sum log(1 - r^2) - log det M - sum log(zeta (1 - zeta)),   r = (entry - printed) / half width,

and takes the lowest of the centres as the device. How far the answer is determined is the spread of all models met on
walks inside the rounding from every centre. A walk does not pass from one division of the mass between the modes to
another (the way is too narrow), so the spread is that of the models found from random starts, not a probability.
"""

from __future__ import annotations

import argparse
import math
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares, minimize
from scipy.special import expit, log_expit, logit

import tarsus as ts
from tarsus.files.toml import write_scene
from tarsus.measure.mac import mac
from tarsus.model.scene import Provenance, Source
from tarsus.model.structure.base import Matrices
from tarsus_reproduce.printed import ModalForm, PrintedModel, interval, modal_structure, printed_model

Array = NDArray[Any]
SYSTEM_MASS = 2.7e-3  # Table 3.3 [kg]
POINTS = ("foot1", "foot2", "body", "foot3", "foot4")
KINDS = ("M", "C", "K")


@dataclass(frozen=True)
class Printed:
    """The printed entries (3, m) of the upper triangles of M, C, K and their half widths, with unit diagonal of M."""

    model: PrintedModel
    scale: Array
    """Signed root (n,) of M's diagonal: A = B * scale."""
    values: Array
    halves: Array
    omega: Array

    @classmethod
    def of(cls, model: PrintedModel) -> Printed:
        mass = model.matrices.mass
        along = np.linalg.eigh(mass)[1][:, -1]
        scale = np.sqrt(np.diag(mass)) * np.sign(along)
        upper = np.triu_indices(len(mass))
        unit = np.outer(scale, scale)[upper]

        def entries(of: Matrices) -> Array:
            return np.array([one[upper] for one in (of.mass, of.damping, of.stiffness)])

        values, halves = entries(model.matrices) / unit, entries(model.half_widths) / np.abs(unit)
        return cls(model, scale, values, halves, 2.0 * math.pi * model.table_frequencies)

    @property
    def size(self) -> int:
        return len(self.omega)

    def split(self, x: Array) -> tuple[Array, Array]:
        """B (..., n, n) and damping ratios (..., n) of unknowns (..., n n + n)."""
        n = self.size
        return x[..., : n * n].reshape(*x.shape[:-1], n, n), expit(x[..., n * n :])

    def factors(self, zeta: Array) -> Array:
        """Modal mass, damping and stiffness (..., 3, n)."""
        one = np.ones_like(zeta)
        return np.stack([one, 2.0 * zeta * self.omega, one * self.omega**2], axis=-2)

    def residuals(self, x: Array) -> Array:
        """Distance of every entry from its printed value in half widths (..., 3, m)."""
        b, zeta = self.split(x)
        first, second = np.triu_indices(self.size)
        got = np.einsum("...tk,...km->...tm", self.factors(zeta), b[..., first] * b[..., second])
        return (got - self.values) / self.halves

    def slopes(self, x: Array) -> Array:
        """Derivative of the residuals (..., 3, m, n n + n)."""
        b, zeta = self.split(x)
        n, (first, second) = self.size, np.triu_indices(self.size)
        one, two = b[..., first].swapaxes(-1, -2), b[..., second].swapaxes(-1, -2)  # (..., m, k)
        pick = np.eye(n)
        by_b = two[..., None] * pick[first][:, None, :] + one[..., None] * pick[second][:, None, :]
        by_b = self.factors(zeta)[..., :, None, :, None] * by_b[..., None, :, :, :]
        by_zeta = np.zeros((*by_b.shape[:-2], n))
        by_zeta[..., 1, :, :] = one * two * (2.0 * self.omega * zeta * (1.0 - zeta))[..., None, :]
        whole = np.concatenate([by_b.reshape(*by_b.shape[:-2], n * n), by_zeta], axis=-1)
        return whole / self.halves[..., None]


def feasible(printed: Printed, rng: np.random.Generator, x: Array | None = None, margin: float = 0.95) -> Array | None:
    """Unknowns of a model with every entry within its rounding, from a random start; None if it was not reached."""
    n, omega = printed.size, printed.omega
    if x is None:
        mean = printed.values[2].mean() / printed.values[0].mean()
        share = rng.dirichlet(np.full(n, 0.7)) / np.maximum(omega**2 / mean, 1.0)
        spread = 0.05 * np.minimum(1.0, math.sqrt(mean) / omega)
        b = np.sqrt(share / share.sum())[:, None] + rng.normal(size=(n, n)) * spread[:, None]
        x = np.concatenate([b.ravel(), rng.normal(size=n)])

    def excess(x: Array, held: float) -> Array:
        r = printed.residuals(x)
        return (np.sign(r) * np.maximum(np.abs(r) - held, 0.0)).ravel()

    def slopes(x: Array, held: float) -> Array:
        return (printed.slopes(x) * (np.abs(printed.residuals(x)) > held)[..., None]).reshape(-1, x.size)

    for held in (0.0, margin):
        x = np.asarray(least_squares(excess, x, slopes, args=(held,), x_scale="jac", max_nfev=300).x)  # pyright: ignore[reportArgumentType]
        x = np.append(x[: n * n], np.clip(x[n * n :], -9.0, 9.0))
    return x if worst(printed, x) < 1.0 else None


def worst(printed: Printed, x: Array) -> float:
    """Largest distance of an entry from its printed value, in half widths."""
    return float(np.abs(printed.residuals(x)).max())


def barrier(printed: Printed, x: Array) -> tuple[float, Array]:
    """How near the bounds a model is, and the gradient; infinite outside."""
    b, zeta = printed.split(x)
    r = printed.residuals(x)
    if np.abs(r).max() >= 1.0:
        return math.inf, np.zeros_like(x)
    y = x[b.size :]
    value = -np.log1p(-(r**2)).sum() - 2.0 * np.linalg.slogdet(b)[1] - (log_expit(y) + log_expit(-y)).sum()
    slope = np.einsum("tm,tmx->x", 2.0 * r / (1.0 - r**2), printed.slopes(x))
    slope[: b.size] -= 2.0 * np.linalg.inv(b).T.ravel()
    slope[b.size :] += 2.0 * zeta - 1.0
    return float(value), slope


def metric(printed: Printed, x: Array) -> Array:
    """Positive definite part of the barrier's second derivative (..., p, p): the shape of the bounds around a model."""
    b, zeta = printed.split(x)
    r, slopes = printed.residuals(x), printed.slopes(x)
    n = printed.size
    weighted = slopes * (2.0 * (1.0 + r**2) / (1.0 - r**2) ** 2)[..., None]
    whole = np.einsum("...tmx,...tmy->...xy", weighted, slopes, optimize=True)
    back = np.linalg.inv(b)
    gram = 2.0 * back @ back.swapaxes(-1, -2)
    for k in range(n):
        whole[..., k * n : (k + 1) * n, k * n : (k + 1) * n] += gram
    index = np.arange(n * n, n * n + n)
    whole[..., index, index] += np.maximum(2.0 * zeta * (1.0 - zeta), 1e-3)
    return whole


def centre(printed: Printed, x: Array) -> tuple[float, Array]:
    """The analytic centre reached from a model within the rounding: its barrier and unknowns."""
    for _ in range(10):
        step = np.linalg.inv(np.linalg.cholesky(metric(printed, x))).T

        def around(u: Array, x: Array = x, step: Array = step) -> tuple[float, Array]:
            value, slope = barrier(printed, x + step @ u)
            return (value if math.isfinite(value) else 1e10), step.T @ slope

        found = minimize(around, np.zeros_like(x), jac=True, method="BFGS", options={"maxiter": 300, "gtol": 1e-7})
        x = x + step @ found.x
        if np.linalg.norm(around(found.x)[1]) < 1e-5:
            break
    return barrier(printed, x)[0], x


def wander(printed: Printed, starts: Array, steps: int, rng: np.random.Generator) -> Array:
    """Models within the rounding (kept, chains, p) met on walks from ``starts`` (chains, p).

    Every step is uniform on what the bounds leave of a random line through the model (slice sampling, flat in A
    and zeta); the lines take their directions from the bounds' shape at any of the starts.
    """
    chains, size = starts.shape
    n = printed.size
    square = n * n

    def one_sign(x: Array) -> Array:
        rows = x[:, :square].reshape(-1, n, n)
        return np.hstack([(rows * np.sign(rows.mean(axis=2, keepdims=True))).reshape(-1, square), x[:, square:]])

    def inside(x: Array) -> NDArray[np.bool_]:
        zeta = x[:, square:]
        good = np.all((zeta > 0.0) & (zeta < 1.0), axis=1)
        rows = x[:, :square].reshape(-1, n, n)
        first, second = np.triu_indices(n)
        got = printed.factors(zeta) @ (rows[..., first] * rows[..., second])
        return good & (np.abs((got - printed.values) / printed.halves).max(axis=(1, 2)) < 1.0)

    x = one_sign(starts)
    turn = np.linalg.inv(np.linalg.cholesky(metric(printed, x))).swapaxes(1, 2)
    x[:, square:] = expit(x[:, square:])
    turn[:, square:] *= (x[:, square:] * (1.0 - x[:, square:]))[..., None]
    kept = []
    for step in range(steps):
        line = (turn[rng.integers(chains, size=chains)] @ rng.normal(size=(chains, size, 1)))[..., 0]
        length = np.exp(rng.uniform(math.log(0.3), math.log(10.0), chains))
        low = -length * rng.uniform(size=chains)
        high = low + length
        open_ = np.arange(chains)
        while open_.size:
            at = rng.uniform(low[open_], high[open_])
            tried = x[open_] + at[:, None] * line[open_]
            good = inside(tried)
            x[open_[good]] = tried[good]
            open_, at = open_[~good], at[~good]
            low[open_] = np.where(at < 0.0, at, low[open_])
            high[open_] = np.where(at < 0.0, high[open_], at)
        x = one_sign(x)
        if step >= steps // 4 and step % 20 == 0:
            kept.append(np.hstack([x[:, :square], logit(x[:, square:])]))
    return np.array(kept)


def matrices(printed: Printed, x: Array) -> Matrices:
    """M, C, K (n, n) of one model in printed units."""
    b, zeta = printed.split(x)
    a = b * printed.scale
    return Matrices(*((a.T * factor) @ a for factor in printed.factors(zeta)))


def shapes(printed: Printed, x: Array) -> Array:
    """Mass-normalised shapes (..., n points, n modes), each positive at the first point."""
    found = np.linalg.inv(printed.split(x)[0] * printed.scale)
    return found * np.where(found[..., :1, :] < 0.0, -1.0, 1.0)


@dataclass(frozen=True)
class Rebuilt:
    """The models found: barrier and unknowns of every centre, lowest first, and the models met on walks."""

    printed: Printed
    tried: int
    barriers: Array
    centres: Array
    met: Array

    @property
    def best(self) -> Array:
        return self.centres[0]


def rebuild(starts: int, steps: int, seed: int = 0) -> Rebuilt:
    """Random starts, their centres, and walks of so many steps from each."""
    printed, rng = Printed.of(printed_model("quadruped")), np.random.default_rng(seed)
    found = [x for x in (feasible(printed, rng) for _ in range(starts)) if x is not None]
    centres = sorted((centre(printed, x) for x in found), key=lambda one: one[0])
    points = np.array([x for _, x in centres])
    met = wander(printed, points, steps, rng)
    return Rebuilt(printed, starts, np.array([f for f, _ in centres]), points, met.reshape(-1, points.shape[1]))


def form(printed: Printed, x: Array) -> ModalForm:
    """The modal form of one model: the table's frequencies, its shapes and damping."""
    zeta = printed.split(x)[1]
    return ModalForm(printed.omega / (2.0 * math.pi), shapes(printed, x), np.diag(2.0 * zeta * printed.omega))


def unit_mass(model: PrintedModel) -> float:
    """What one unit of printed mass weighs [kg] if all points together weigh the system mass of Table 3.3."""
    return float(f"{SYSTEM_MASS / model.matrices.mass.sum():.4g}")


def readings_held(starts: int, seed: int = 1) -> dict[float, int]:
    """How many starts reach a model that holds K[2, 4] as printed above the diagonal, and how many as below."""
    model, rng = printed_model("quadruped"), np.random.default_rng(seed)
    counts = {}
    for value in (3.27e8, 3.21e8):
        stiffness, half = model.matrices.stiffness.copy(), model.half_widths.stiffness.copy()
        stiffness[[1, 3], [3, 1]], half[[1, 3], [3, 1]] = value, 0.5e6
        printed = Printed.of(
            replace(
                model,
                matrices=replace(model.matrices, stiffness=stiffness),
                half_widths=replace(model.half_widths, stiffness=half),
            )
        )
        counts[value] = sum(feasible(printed, rng) is not None for _ in range(starts))
    return counts


def report(rebuilt: Rebuilt) -> None:
    """Print the model, how well it holds the printed digits, and how far they determine it."""
    printed, best = rebuilt.printed, rebuilt.best
    print(f"{len(rebuilt.centres)} of {rebuilt.tried} starts reached a model with every entry within its rounding")
    levels, counts = np.unique(np.round(rebuilt.barriers, 2), return_counts=True)
    print("centres (barrier x times met):", ", ".join(f"{f:.2f} x {n}" for f, n in zip(levels, counts, strict=True)))
    r = printed.residuals(best)
    print(f"largest distance of an entry from its printed value: {np.abs(r).max():.2f} of its half width")
    for kind, of in zip(KINDS, r, strict=True):
        print(f"  {kind}: largest {np.abs(of).max():.2f}, root mean square {np.sqrt(np.mean(of**2)):.2f}")
    pair = [matrices(printed, x).stiffness[1, 3] for x in rebuilt.met[::7]]
    print(f"K[2,4] printed as 3.27e8 and 3.21e8: {min(pair):.4g} to {max(pair):.4g} in all models met")
    zeta, met = printed.split(best)[1], printed.split(rebuilt.met)
    row("damping ratio", zeta, met[1])
    share = np.square(printed.split(best)[0][:, 2])
    row("share of the body's mass", share, np.square(met[0][..., 2]))
    mine, all_shapes = shapes(printed, best), shapes(printed, rebuilt.met)
    for i, point in enumerate(POINTS):
        row(f"shape at {point}", mine[i], all_shapes[:, i])
    row(
        "body / largest foot",
        np.abs(mine[2]) / np.abs(mine).max(axis=0),
        np.abs(all_shapes[:, 2]) / np.abs(all_shapes).max(axis=1),
    )
    unit = unit_mass(printed.model)
    effective = unit / np.square(all_shapes[:, 0]).sum(axis=-1)
    low, high = interval(effective)
    felt = unit / np.square(mine[0]).sum()
    print(f"unit of mass {unit:.4g} kg, mass felt at foot1 {felt:.3g} kg ({low:.2g} to {high:.2g})")
    column = printed.model.restitution_column
    for alpha in (column[0], -column[0]):
        shape = np.append(1.0, column[1:] / (alpha - 1.0))
        row(f"MAC with R, {alpha:+.2f}", mac(mine, shape), np.array([mac(one, shape) for one in all_shapes[::7]]))


def row(what: str, values: Array, met: Array) -> None:
    """One line a quantity: value and spread of every mode."""
    low, high = interval(met)
    cells = (f"{v:8.3g} ({a:.2g} to {b:.2g})" for v, a, b in zip(values, low, high, strict=True))
    print(f"{what:>24}: " + "  ".join(cells))


def described(rebuilt: Rebuilt) -> dict[str, object]:
    """The device's structure and its provenance, by path."""
    printed, best = rebuilt.printed, rebuilt.best
    structure = modal_structure(form(printed, best), POINTS, unit_mass(printed.model))
    spread = {"damping_ratios": printed.split(rebuilt.met)[1]}
    spread |= {f"shapes.{p}": shapes(printed, rebuilt.met)[:, i] for i, p in enumerate(POINTS)}
    note = "examples/rebuild_quadruped.py: the analytic centre of all models with modal damping and the frequencies of "
    note += "Table 3.3 that hold every printed entry of M, C, K within its rounding; interval: 95 % of the models met."
    provenance = {
        "frequencies": Provenance(source=Source.PRINTED, note="Table 3.3; the printed matrices are indefinite (E9)."),
        "modal_masses": Provenance(
            source=Source.ASSUMED,
            note="Shapes are mass-normalised in the unit of the printed matrices, which is not printed: one unit of "
            "mass such that all points moving together weigh 2.7 g, Table 3.3. Foot 1 then feels a few micrograms, far "
            "too little for a leg; the scale is no more than a choice. Forces of absolute size depend on it; motion "
            "under a calibrated drive does not.",
        ),
    }
    for name, values in spread.items():
        bounds = tuple((round_to(a), round_to(b)) for a, b in zip(*interval(values), strict=True))
        provenance[name] = Provenance(source=Source.DERIVED, note=note, interval=bounds)
    paths: dict[str, object] = {"robot.structure": structure}
    return paths | {"provenance": {f"robot.structure.{name}": one for name, one in provenance.items()}}


def round_to(value: float, digits: int = 3) -> float:
    """A bound with as many digits as it deserves."""
    return float(f"{value:.{digits}g}")


def main() -> None:
    parser = argparse.ArgumentParser(description="Rebuild the quadruped's model from its printed digits.")
    parser.add_argument("--starts", type=int, default=96, help="random starts")
    parser.add_argument("--steps", type=int, default=4000, help="steps of the walk from each centre")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--write", help="TOML file: the packaged device with this structure")
    args = parser.parse_args()
    rebuilt = rebuild(args.starts, args.steps, args.seed)
    report(rebuilt)
    for value, count in readings_held(args.starts // 3).items():
        print(f"K[2,4] = {value:.3g} held by {count} of {args.starts // 3} starts")
    if args.write:
        device = ts.load_scene("quadruped")
        values = described(rebuilt)
        values["provenance"] = {**device.provenance, **values["provenance"]}  # type: ignore[dict-item]
        write_scene(ts.with_values(device, values), args.write)


if __name__ == "__main__":
    main()
