"""A start that stands is an empty table in a file, which is not an absent one."""

from __future__ import annotations

import tarsus as ts
from tarsus.files.toml import parse_scene, scene_text
from walking_devices import creeping_millipede


def test_a_standing_start_is_written_and_read_back():
    scene = ts.with_values(creeping_millipede(), {"initial": {"standing": {}}})
    text = scene_text(scene)
    assert "[initial.standing]" in text
    assert parse_scene(text) == scene != creeping_millipede()
