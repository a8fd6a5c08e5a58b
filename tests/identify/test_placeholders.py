"""What a device file holds where it is said to be unknown changes nothing of the result."""

from __future__ import annotations

from dataclasses import replace

import pytest

from identify.campaigns import folder, grounded, identified, modes_as_found
from tarsus.identify.campaign import Opened, read_campaign
from tarsus.identify.chain import StepRunner
from tarsus.identify.steps import STEPS
from tarsus.synthesis.devices import identified_paths


def changed(opened: Opened, factor: float) -> StepRunner:
    """The chain of a device that holds other placeholders, with its records read."""
    scene = opened.model.scene
    values = {"robot.drives.pzt.law.linear": 1e-6 * factor, "robot.drives.pzt.law.constant": 1e-7 * factor}
    values |= {"ground.film.coefficient": 1e-20 * factor, "ground.film.thickness": 1e-5 * factor}
    values |= {
        "robot.structure.damping_ratios.0": 0.02 * factor,
        "robot.structure.frequencies.0": 550.0 + 20.0 * factor,
    }
    values |= {"robot.drives.pzt.load.participation.1": factor, "ground.adhesion.rate": 1e-6 * factor}
    assert set(values) <= set(identified_paths(scene))
    return grounded(replace(opened, model=opened.model.changed(values)))


def values(chain: StepRunner) -> dict[str, float]:
    assert not chain.not_done
    return dict(zip(chain.known.paths, chain.known.values.tolist(), strict=True))


def same(one: dict[str, float], other: dict[str, float]) -> None:
    assert one and one.keys() == other.keys()
    for path, value in one.items():
        scale = max(abs(value), 1e-9 if "weights" in path else 0.0)
        assert other[path] == pytest.approx(value, rel=1e-3, abs=1e-3 * scale), path


def test_placeholders_of_the_law_do_not_matter(monkeypatch):
    modes_as_found(monkeypatch)
    found = identified()
    chain = changed(read_campaign(folder()), 3.0)
    chain.take(STEPS[:2])
    known = dict(zip(found.known.paths, found.known.values.tolist(), strict=True))
    same({path: known[path] for path in chain.known.paths}, values(chain))
