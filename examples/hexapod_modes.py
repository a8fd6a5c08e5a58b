"""The hexapod's modes from its printed digits, and what their rounding leaves open.

    python examples/hexapod_modes.py [--draws 10000] [--write FOLDER]

The matrices of appendix B have three digits (M two decimals). Models whose entries are uniform within half a unit of
the last digit differ by several percent in their frequencies, and by a factor of two in the first: a stiffness of three
digits cannot hold a mode of 117 Hz beside one of 2866 Hz any better. The sixth mode keeps its shape, which is near that
of the printed impact matrix. With --write, the structures of `hexapod` and `hexapod-table` are written into copies of
the packaged devices.
"""

from __future__ import annotations

import argparse
import math
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

import tarsus as ts
from tarsus.files.toml import write_scene
from tarsus.measure.mac import mac
from tarsus.model.scene import Provenance, Scene, Source
from tarsus_reproduce.printed import (
    ModalForm,
    PrintedModel,
    interval,
    modal_form,
    modal_structure,
    printed_model,
    rounding,
)

Array = NDArray[np.float64]
SYSTEM_MASS = 0.16e-3  # Table 3.3 [kg]
POINTS = tuple(f"foot{i}" for i in range(1, 7))


def impact_shape(model: PrintedModel) -> Array:
    """Velocity change of every point (n,) relative to the contact foot's, from the printed R: (3.17), (3.32)."""
    change = model.restitution_column - np.eye(len(model.restitution_column))[0]
    return change / change[0]


def impact_columns(shapes: Array, restitution: float, mode: int = -1) -> Array:
    """First column (..., n) of R_CoR if one mode takes the impact, equations (3.20)-(3.24), with e for -alpha."""
    shape = shapes[..., mode] / shapes[..., :1, mode]
    return np.eye(shape.shape[-1])[0] - (1.0 + restitution) * shape


def unit_mass(model: PrintedModel) -> float:
    """What one unit of printed mass weighs [kg] if all feet moving together weigh the system mass of Table 3.3."""
    return float(f"{SYSTEM_MASS / model.matrices.mass.sum():.4g}")


def report(model: PrintedModel, form: ModalForm, share: float, spread: ModalForm) -> None:
    """Print modes, their intervals, and how well each matches the printed impact matrix."""
    print(f"{share:.1%} of {len(spread.frequencies) / share:.0f} draws are positive definite")
    print("mode  printed matrices [Hz]   95 % of the rounding   Table 3.3   damping ratio        MAC with R")
    shape = impact_shape(model)
    alike = np.array([mac(one, shape) for one in spread.shapes])
    bounds = [interval(values) for values in (spread.frequencies, spread.damping_ratios, alike)]
    for k, table in enumerate(model.table_frequencies):
        (fl, fh), (zl, zh), (ml, mh) = ((low[k], high[k]) for low, high in bounds)
        print(
            f"{k + 1:4d}  {form.frequencies[k]:21.1f}   {fl:8.1f} to {fh:8.1f}   {table:9.1f}   "
            f"{form.damping_ratios[k]:.4f} ({zl:.4f} to {zh:.4f})   "
            f"{mac(form.shapes[:, k], shape):.3f} ({ml:.3f} to {mh:.3f})"
        )
    e = -float(model.restitution_column[0])
    low, high = interval(impact_columns(spread.shapes, e))
    print(f"first column of R_CoR by mode 6, e = {e:.2f} (printed; 95 % of the rounding):")
    for one, printed, a, b in zip(impact_columns(form.shapes, e), model.restitution_column, low, high, strict=True):
        print(f"  {one:6.2f}  ({printed:5.2f}; {a:5.2f} to {b:5.2f})")
    print(f"largest coupling of modes by damping: {form.coupling:.2f} of the geometric mean of the two modes'")
    felt = unit_mass(model) / np.square(form.shapes[0]).sum()
    print(f"unit of mass {unit_mass(model):.4g} kg, mass felt at foot1 {felt:.3g} kg")


def described(device: Scene, model: PrintedModel, form: ModalForm, spread: ModalForm) -> Scene:
    """A device with this structure and its provenance."""
    name = "robot.structure"
    bounds = {"frequencies": spread.frequencies, "damping_ratios": spread.damping_ratios}
    bounds |= {f"shapes.{point}": spread.shapes[:, i] for i, point in enumerate(POINTS)}
    draws = "interval: 95 % of models drawn within the printed rounding (examples/hexapod_modes.py)."
    notes = {
        "frequencies": f"Modes of the printed M and K, appendix B; {draws}",
        "damping_ratios": "Diagonal of P^T C P of the printed C, mass-normalised modes P; its other entries, up to "
        f"{form.coupling:.2f} of the geometric mean of their two modes', are left out; {draws}",
    }
    if device.name == "hexapod-table":
        notes["damping_ratios"] = "The ratios of device hexapod, of the printed matrices; " + draws
    e = -float(model.restitution_column[0])
    low, high = interval(impact_columns(spread.shapes, e))
    for i, point in enumerate(POINTS):
        column = f"{impact_columns(form.shapes, e)[i]:.2f} ({low[i]:.2f} to {high[i]:.2f} over the rounding)"
        notes[f"shapes.{point}"] = (
            f"Mass-normalised modes of the printed M and K; the first column of R_CoR by mode 6 alone, (3.24), has "
            f"{column} here and {model.restitution_column[i]:.2f} printed; {draws}"
        )
    provenance = {
        f"{name}.{key}": Provenance(source=Source.DERIVED, note=note, interval=pairs(bounds[key]))
        for key, note in notes.items()
    }
    if device.name == "hexapod-table":
        form = replace(form, frequencies=model.table_frequencies, damping=table_damping(model, form))
        provenance[f"{name}.frequencies"] = Provenance(
            source=Source.PRINTED,
            note="Row of Table 3.3; the printed matrices hold these as well within their rounding (E10).",
        )
    provenance[f"{name}.modal_masses"] = Provenance(
        source=Source.ASSUMED,
        note="Shapes are mass-normalised in the unit of the printed matrices, which is not printed: one unit of mass "
        "such that all feet moving together weigh 0.16 g, Table 3.3. Foot 1 then feels 0.15 mg, little for a leg; "
        "the scale is no more than a choice. Forces of absolute size depend on it; motion under a calibrated drive "
        "does not.",
    )
    structure = modal_structure(form, POINTS, unit_mass(model))
    return ts.with_values(device, {name: structure, "provenance": {**device.provenance, **provenance}})


def table_damping(model: PrintedModel, form: ModalForm) -> Array:
    """Modal damping (n, n) that keeps the damping ratios at the frequencies of Table 3.3."""
    return np.diag(4.0 * math.pi * model.table_frequencies * form.damping_ratios)


def pairs(samples: Array) -> tuple[tuple[float, float], ...]:
    """95 % interval of every column, with the digits it deserves."""
    low, high = interval(samples)
    return tuple((float(f"{a:.3g}"), float(f"{b:.3g}")) for a, b in zip(low, high, strict=True))


def main() -> None:
    parser = argparse.ArgumentParser(description="The hexapod's modes from its printed digits.")
    parser.add_argument("--draws", type=int, default=10_000)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--write", type=Path, help="folder for the two devices")
    args = parser.parse_args()
    model = printed_model("hexapod")
    form, (share, spread) = modal_form(model.matrices), rounding(model, args.draws, args.seed)
    report(model, form, share, spread)
    if args.write is not None:
        for name in ("hexapod", "hexapod-table"):
            write_scene(described(ts.load_scene(name), model, form, spread), args.write / f"{name}.toml")


if __name__ == "__main__":
    main()
