"""What `tarsus reproduce --all` does: every page into a folder of its own, and an index."""

from __future__ import annotations

import json as formats
from pathlib import Path

from tarsus_reproduce.cli.millipede import Asked


def run(output: Path, seeds: int | None, asked: Asked, *, json: bool) -> int:
    """Reproduce everything and write the index; the largest exit code of all."""
    from tarsus.cli import console
    from tarsus_reproduce.cli import cantilever, millipede, robot
    from tarsus_reproduce.pages.index import EXPERIMENTS, write_index

    worst, results = 0, {}
    for number, one in enumerate(EXPERIMENTS, 1):
        console.say(f"{number} of {len(EXPERIMENTS)}: {one.title}")
        folder = output / one.folder
        if one.kind == "cantilever":
            assert one.device is not None
            device = (
                None if one.device == one.kind else one.device
            )  # that of the experiment's name is its mixture
            code = cantilever.run(device, None, folder, json=False, quiet=True)
        elif one.kind == "robot":
            assert one.device is not None
            code = robot.run(one.device, None, None, seeds, folder, json=False, quiet=True)
        else:
            code = millipede.run(None, folder, asked, json=False, quiet=True)
        worst = max(worst, code)
        results[one.folder] = formats.loads((folder / "reproduction.json").read_text(encoding="utf-8"))
    write_index(results, output / "index.html")
    if json:
        console.print_json({"index": str(output / "index.html"), "experiments": results})
    else:
        console.wrote([*(output / one.folder for one in EXPERIMENTS), output / "index.html"])
    return worst
