"""Headers for a microcontroller: a program of C that goes by them gives the drives' volts."""

from __future__ import annotations

import subprocess

import numpy as np
import pytest

import tarsus as ts
from tarsus.base.errors import InputError

PROGRAM = """#include <stdio.h>
#include "drives.h"
int main(void) {
  for (uint32_t i = 0; i < drives_count; i++)
    for (uint32_t k = drives_begin[i]; k < drives_begin[i + 1]; k++)
      printf("%u %u %d\\n", (unsigned)i, (unsigned)drives_ticks[k], (int)drives_millivolts[k]);
  printf("%u %u %s\\n", (unsigned)drives_period_ticks, (unsigned)drives_tick_ns, DRIVES_DIGEST);
  return 0;
}
"""


@pytest.mark.compiler
@pytest.mark.parametrize(("name", "most"), [("cantilever", 1e-3), ("ball-on-table", 0.02)])
def test_a_program_plays_the_volts(name, most, tmp_path):
    hostile = "a */ #error pwned\n#error \\\n/* é"
    scene = ts.load_scene(name).model_copy(update={"name": hostile})
    ts.export(scene, "c", tmp_path, duration=0.02)
    (tmp_path / "main.c").write_text(PROGRAM)
    subprocess.run(["cc", "-std=c99", "-Wall", "-Werror", "-o", "main", "main.c"], cwd=tmp_path, check=True)
    out = subprocess.run([tmp_path / "main"], capture_output=True, text=True, check=True).stdout.splitlines()
    *rows, (period, tick, _) = (line.split() for line in out)
    table = np.array(rows, dtype=int)
    now = np.arange(int(period))
    played = 1e-3 * table[np.searchsorted(table[:, 1], now, side="right") - 1, 2]
    ((_, wave),) = scene.waveforms.items()
    wanted = wave.volts((now + 0.5) * 1e-9 * int(tick))
    assert np.abs(played - wanted).max() < most * np.abs(wanted).max()


def test_a_sine_is_held_between_many_values(tmp_path):
    (_, said) = ts.export("ball-on-table", "c", tmp_path, duration=0.02).to_dict()["lost"]
    assert 200 < int(said.split("held between ")[1].split()[0]) <= 256


def test_a_walker_has_its_gait(tmp_path):
    found = ts.export("millipede", "c", tmp_path, duration=0.01, step=2e-6)
    text = (tmp_path / "gait.h").read_text()
    assert "gait_tick_ns = 2000u" in text and found.to_dict()["files"] == [
        str(tmp_path / n) for n in ("gait.h", "lost.txt")
    ]


def test_equal_volts_have_equal_digests(tmp_path):
    texts = []
    for k, volts in enumerate((8.0, 8.0, 8.001)):
        ts.export(ts.load_scene("cantilever", volts=volts), "c", tmp_path / str(k), duration=0.02)
        texts.append((tmp_path / str(k) / "drives.h").read_text())
    assert texts[0] == texts[1] != texts[2]


def test_drives_without_a_common_period_are_refused(tmp_path):
    scene = ts.load_scene("millipede")
    scene = ts.with_values(
        scene,
        {
            "gait": None,
            "signals.L1": ts.Sine(amplitude=1.0, frequency=100.0),
            "signals.R1": ts.Sine(amplitude=1.0, frequency=70.0),
        },
    )
    with pytest.raises(InputError, match="have no common one"):
        ts.export(scene, "c", tmp_path, duration=0.01)
