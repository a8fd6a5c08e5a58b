"""What one version has made never goes on in another: the hash holds every file that results depend on."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import tarsus
from tarsus.files.version import SHOWING, result_sources

ROOT = Path(tarsus.__file__).parent


def test_every_source_that_a_run_and_its_measures_load_is_in_the_hash() -> None:
    """Of a process that simulates, sweeps, calibrates and designs: what it has loaded but rooms that show results."""
    code = (
        "import sys, tarsus as ts, tarsus.study, tarsus.calibrate, tarsus.design, tarsus.identify\n"
        "ts.simulate('cantilever', '1 ms').measures; ts.simulate('millipede', '1 ms').measures\n"
        "own = [m.__file__ for n, m in list(sys.modules.items()) if n.split('.')[0] == 'tarsus']\n"
        "print(*filter(None, own), sep='\\n')"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    loaded = {Path(line).relative_to(ROOT) for line in done.stdout.splitlines()}
    assert Path("model/drive/laws/prandtl_ishlinskii.py") in loaded and Path("solve/engine.py") in loaded
    needed = {path for path in loaded if path.parts[0] not in SHOWING}
    assert needed <= {path.relative_to(ROOT) for path in result_sources()}
