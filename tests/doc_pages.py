"""Pages of the documentation, and what their snippets need."""

from __future__ import annotations

import re
from pathlib import Path

ROOT = Path(__file__).parents[1]
PAGES = {path.name: path.read_text(encoding="utf-8") for path in (ROOT / "docs").glob("*.md")}
PAGES["CONTRIBUTING.md"] = (ROOT / "CONTRIBUTING.md").read_text(encoding="utf-8")


def sweep_study(folder: Path) -> None:
    """The study of the page of sweeps as my-study.toml, with fewer and shorter runs: 12 of 10 ms."""
    (text,) = re.findall(r"```toml\n(name.*?)```", PAGES["sweeps.md"], re.DOTALL)
    text = text.replace("0.1 s", "10 ms").replace("count = 9", "count = 2").replace("count = 5", "count = 2")
    (folder / "my-study.toml").write_text(text, encoding="utf-8")
