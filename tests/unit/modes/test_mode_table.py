"""Normal modes of universal files as a structure, and as the modes of a walker's body."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import pyuff

from tarsus.base.errors import InputError
from tarsus.model.structure import Lumped, body_modes
from tarsus.modes import read_mode_table

MASS = (3e-4, 6e-4, 3e-4)
BEAM = Lumped(
    coordinates=("front", "middle", "hind"), mass=("0.3 g", "0.6 g", "0.3 g"),
    stiffness=((400.0, -400.0, 0.0), (-400.0, 800.0, -400.0), (0.0, -400.0, 400.0)), damping_ratios=(0.0, 0.02, 0.02),
)  # fmt: skip
BENDING = (1.0, -1.0, 1.0)
"""Its highest mode: ends against the middle, omega^2 = 400/0.3e-3 + 400/0.3e-3."""


def written(
    path: Path, *, masses: tuple[float, ...] = (1.2e-3,), analysis: int = 2, units: bool = False
) -> Path:
    file = pyuff.UFF(str(path))
    if units:  # millimetres and newton: masses in tonnes
        file.write_sets(
            pyuff.prepare_164(units_code=9, units_description="mm", temp_mode=1, length=1e3, force=1.0, temp=1.0,
                              temp_offset=0.0),
            "overwrite",
        )  # fmt: skip
    for number, mass in enumerate(masses, 1):
        file.write_sets(
            pyuff.prepare_55(
                model_type=1, id1="bending", id2="NONE", id3="NONE", id4="NONE", id5="NONE", analysis_type=analysis,
                data_ch=2, spec_data_type=8, data_type=2 if analysis == 2 else 5, n_data_per_node=3,
                r1=np.zeros(3), r2=np.zeros(3), r3=np.array(BENDING), load_case=1, mode_n=number, node_nums=[1, 2, 7],
                freq=np.sqrt(800.0 / 3e-4) / (2.0 * np.pi), modal_m=mass, modal_damp_vis=0.02, modal_damp_his=0.0,
                eig=1j, modal_a=0j, modal_b=0j,
            ),
            "add" if units or number > 1 else "overwrite",
        )  # fmt: skip
    return path


@pytest.mark.parametrize("units", [False, True])
def test_table_gives_the_body_its_matrices_give(tmp_path: Path, units: bool) -> None:
    mass = 1.2e-3 * (1e-3 if units else 1.0)
    structure = read_mode_table(written(tmp_path / "beam.unv", masses=(mass,), units=units))
    assert structure.points == ("1_Z", "2_Z", "7_Z")
    (mode,) = body_modes(structure, 10.0, {"LF": "1_Z", "LH": "7_Z", "bag": "2_Z"}).values()
    known = body_modes(BEAM, 10.0, {"LF": "front", "LH": "hind", "bag": "middle"})["mode2"]
    assert mode.frequency == pytest.approx(known.frequency, rel=1e-5)  # five digits in the file
    assert mode.mass == pytest.approx(known.mass, rel=1e-5)
    assert mode.damping_ratio == pytest.approx(known.damping_ratio)
    sign = np.sign(mode.upward["LF"] * known.upward["LF"])
    assert {name: sign * one for name, one in mode.upward.items()} == pytest.approx(known.upward)


def test_tables_that_say_too_little(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="mode 2 has no modal mass"):
        read_mode_table(written(tmp_path / "a.unv", masses=(1e-3, 0.0)))
    with pytest.raises(InputError, match="no normal modes"):
        read_mode_table(written(tmp_path / "b.unv", analysis=3))
    (tmp_path / "c.unv").write_text("f,m\n1,2\n")
    with pytest.raises(InputError, match="no universal file"):
        read_mode_table(tmp_path / "c.unv")
    with pytest.raises(InputError, match="cannot be read"):
        read_mode_table(tmp_path / "none.unv")
