"""A law of one's own, from one plain Python file: a magnet under the ground of the cantilever."""

from __future__ import annotations

from pathlib import Path

import tarsus as ts

LAW_FILE = Path(__file__).parent / "laws" / "magnet.py"


def run_with_magnet(strength: float, duration: float = 0.06):
    """A run of the packaged cantilever with a magnet of a strength [N m^4]."""
    magnet = ts.load_laws(LAW_FILE)["magnet"]
    scene = ts.with_values(ts.load_scene("cantilever"), {"ground.laws.magnet": magnet(strength=strength)})
    return ts.simulate(scene, duration=duration)


if __name__ == "__main__":
    for strength in (0.0, 1e-24, 3e-24):
        run = run_with_magnet(strength)
        work = run.ledger.laws["magnet"]
        print(f"K = {strength:.0e} N m^4: the magnet's work is {work:.3e} J; {run.code.value}")
