"""Files that HDF5 writes on a disk that fills up."""

from __future__ import annotations

import subprocess
import sys

import numpy as np
import pytest
import xarray as xr

from tarsus.files.series import Variable, write_netcdf
from tarsus.files.steady import SteadyFile

# a file may be so long and no longer: what a quota does, and a disk that somebody else fills
FULL = """
import resource, sys
from pathlib import Path
import numpy as np
from tarsus.files.series import Variable, blank, write_netcdf
resource.setrlimit(resource.RLIMIT_FSIZE, (int(sys.argv[2]), int(sys.argv[2])))
puts = []
def fill(put):
    for first in range(0, 8000, 1000):
        put("x", first, np.arange(1000.0))
        puts.append(first)
series = {"x": Variable(("run",), blank((8000,)), {}), "y": Variable(("run",), np.ones(8000), {})}
try:
    write_netcdf(series, {}, Path(sys.argv[1]), fill)
except OSError as error:
    print(error.errno, len(puts))
"""


@pytest.mark.parametrize("room", [100, 20_000, 100_000])
def test_a_disk_that_fills_is_an_error_and_no_crash(tmp_path, room):
    words = [sys.executable, "-c", FULL, str(tmp_path / "x.nc"), str(room)]
    done = subprocess.run(words, capture_output=True, text=True)
    number, puts = done.stdout.split()
    assert (done.returncode, number) == (0, "27")  # EFBIG
    assert int(puts) < 8 and "rror" not in done.stderr, done.stderr


def test_what_there_is_room_for_is_whole(tmp_path):
    values = np.random.default_rng(1).random((300, 7))
    write_netcdf({"x": Variable(("run", "k"), values, {"units": "m"})}, {"title": "t"}, tmp_path / "x.nc")
    with xr.open_dataset(tmp_path / "x.nc") as found:
        assert np.array_equal(found["x"].values, values) and found.attrs["title"] == "t"


def test_an_error_of_the_block_is_not_hidden(tmp_path):
    with pytest.raises(ZeroDivisionError), SteadyFile(tmp_path / "x") as file:
        file.error = OSError(28, "full")
        raise ZeroDivisionError
