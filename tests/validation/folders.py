"""A small experiment of one's own: balls dropped from a height, with their times of fall."""

from __future__ import annotations

from pathlib import Path

FILES = {
    "device.toml": """name = "drop"
duration = "2 s"
[robot.structure]
kind = "lumped"
coordinates = ["ball"]
mass = ["1 g"]
stiffness = ["0 N/m"]
[robot.feet.ball]
point = "ball"
gap = "1 m"
[ground.restitution]
coefficient = 0.5
[ground.gravity]
acceleration = "9.81 m/s^2"
[provenance]
"ground.gravity.acceleration" = { source = "printed", note = "Of the place." }
""",
    "measured.csv": """# A. Author, drops, 2026
height_cm,time_ms,err_ms,who
20,201.9,1,ann
45,302.9/302.7,1,ann
80,440,1,bob
""",
    "study.py": """from tarsus.measure import touchdown
from tarsus.validation import RowCase


def case(row, device):
    gap = 0.01 * row["height_cm"]
    return RowCase({"robot.feet.ball.gap": gap}, lambda run: {"time_ms": touchdown(run, "ball")})
""",
    "claims.toml": """title = "Balls that fall"
[source]
cite = "A. Author, 2026"
[measured.time_ms]
words = "time of fall"
unit = "ms"
spread = "err_ms"
[claims.ann]
rows = 'who == "ann"'
within = { error = 0.001, share = 1.0 }
written = 2026-11-28
seen = "none"
[claims.bob]
rows = 'who == "bob"'
median_error = 0.01
written = 2026-11-28
seen = "all"
should_fail = true
""",
    "notes.md": "Balls.\n",
}


def drop_folder(folder: Path, **changes: tuple[str, str]) -> Path:
    """The experiment in a folder; changes: by the stem of a file, what is replaced in it by what."""
    folder.mkdir(parents=True, exist_ok=True)
    for name, text in FILES.items():
        old, new = changes.get(name.partition(".")[0], ("", ""))
        assert old in text, f"{name} has no {old!r}"
        (folder / name).write_text(text.replace(old, new) if old else text, encoding="utf-8")
    return folder
