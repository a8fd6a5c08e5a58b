"""A newcomer's first hours: what the documentation says is done, line by line, from nothing installed.

    python benchmarks/newcomer.py                       # all pages, into a folder that goes afterwards
    python benchmarks/newcomer.py --pages README.md docs/install.md --keep DIR --json newcomer.json

The tree is cloned (its last commit), the README's command and each page's own commands run as they are printed,
tutorials and notebooks cell by cell in the environment that the pages have made. The commands are read from the pages.
"""

from __future__ import annotations

import argparse
import json
import os
import re
import subprocess
import sys
import tempfile
from dataclasses import asdict, dataclass
from pathlib import Path

ROOT = Path(__file__).parents[1]

FIRST = "docs/install.md"
"""The page that makes the environment which the others use."""

PAGES = (
    "README.md", FIRST, "docs/notebooks/experimentalist.ipynb", "docs/notebooks/designer.ipynb",
    "docs/notebooks/theorist.ipynb", "docs/tutorial-gait.md", "docs/tutorial-landing.md",
)  # fmt: skip
"""In the order in which a newcomer meets them."""

NOT_DONE = re.compile(r"^(pip install jupyterlab|jupyter lab |.*\.\[test\])")
"""Lines that open a window, or pass the tests: the trial leaves them out."""

GOALS = {"tarsus open out": 120.0, "tarsus compare out mine": 600.0, "tarsus check own": 1800.0}
"""Lines of the page of installation by when they should be over, in seconds after its first: a report, a device, a
campaign of one's own."""


@dataclass(frozen=True)
class Step:
    """One line or cell: page, text, wall and CPU time [s], exit code."""

    page: str
    line: str
    wall: float
    cpu: float
    code: int


def commands(text: str, *, marked: str | None = None) -> list[str]:
    """Command lines of the ```bash blocks of a page, continued lines joined; of one block where it is ``marked``."""
    start = "" if marked is None else rf"<!-- command: {marked} -->\n"
    blocks = re.findall(rf"^{start}```bash\n(.*?)^```", text, re.DOTALL | re.MULTILINE)
    lines = [line for block in blocks for line in re.sub(r"\\\n\s*", "", block).splitlines() if line.strip()]
    return [line for line in lines if not NOT_DONE.match(line)]


def cells(page: str, text: str) -> list[str]:
    """Python of a page: its ```python blocks, or the code cells of a notebook."""
    if page.endswith(".ipynb"):
        return ["".join(cell["source"]) for cell in json.loads(text)["cells"] if cell["cell_type"] == "code"]
    return re.findall(r"^```python\n(.*?)^```", text, re.DOTALL | re.MULTILINE)


def follow(page: str, lines: list[str], place: Path) -> list[Step]:
    """Run command lines in one shell, as somebody would type them; up to the first that fails."""
    log = place / "steps.log"
    log.unlink(missing_ok=True)
    typed = "\n".join(f"{line}\nnote $?" for line in lines)
    note = 'note() { echo "$1 $EPOCHREALTIME" >>"$LOG"; times >>"$LOG"; [ "$1" = 0 ] || exit "$1"; }'
    script = f"{note}\nnote 0\n{typed}\n"
    environment = {
        name: value for name, value in os.environ.items() if name not in ("PYTHONPATH", "VIRTUAL_ENV")
    }
    environment |= {"LOG": str(log), "BROWSER": "true", "MPLBACKEND": "agg"}
    subprocess.run(["bash", "-c", script], cwd=place, env=environment, check=False)
    rows = log.read_text(encoding="utf-8").splitlines()
    seen = [(*map(float, rows[i].split()), _seconds(rows[i + 2])) for i in range(0, len(rows), 3)]
    return [
        Step(page, line, now[1] - before[1], now[2] - before[2], int(now[0]))
        for line, before, now in zip(lines, seen, seen[1:], strict=False)
    ]


def _seconds(row: str) -> float:
    """User and system time of a row of the shell's `times`: 0m1.5s 0m0.2s."""
    return sum(
        60.0 * float(minutes) + float(seconds) for minutes, seconds in re.findall(r"(\d+)m([\d.]+)s", row)
    )


RUN_CELLS = """
import ast, json, sys, time
names = {"__name__": "__main__"}
for text in json.load(open(sys.argv[1])):
    wall, cpu = time.perf_counter(), time.process_time()
    tree = ast.parse(text)
    last = tree.body.pop() if tree.body and isinstance(tree.body[-1], ast.Expr) else None
    exec(compile(tree, "cell", "exec"), names)
    if last is not None:
        repr(eval(compile(ast.Expression(last.value), "cell", "eval"), names))
    with open(sys.argv[2], "a") as log:
        log.write(f"{time.perf_counter() - wall} {time.process_time() - cpu}\\n")
"""


def read_along(page: str, texts: list[str], python: Path, place: Path) -> list[Step]:
    """Run cells of a page one after the other in one interpreter; up to the first that fails."""
    given, log, program = place / "cells.json", place / "cells.log", place / "cells.py"
    given.write_text(json.dumps(texts), encoding="utf-8")
    program.write_text(RUN_CELLS, encoding="utf-8")
    log.write_text("", encoding="utf-8")
    environment = {**os.environ, "MPLBACKEND": "agg"}
    environment.pop("PYTHONPATH", None)
    done = subprocess.run([python, program, given, log], cwd=place, env=environment, check=False)
    times = [tuple(map(float, row.split())) for row in log.read_text(encoding="utf-8").splitlines()]
    named = [next((line for line in text.splitlines() if line), "") for text in texts]
    steps = [Step(page, line, *spent, 0) for line, spent in zip(named, times, strict=False)]
    if done.returncode:
        steps.append(Step(page, named[len(times)], 0.0, 0.0, done.returncode))
    return steps


def trial(page: str, place: Path, source: Path) -> list[Step]:
    """One page, followed in a folder of its own."""
    text = (ROOT / page).read_text(encoding="utf-8")
    own = place / Path(page).stem
    own.mkdir()
    tree = place / Path(FIRST).stem / "tarsus"
    if page == "README.md":
        begin = f"git clone -q '{source}' tarsus && cd tarsus"
        return follow(page, [begin, *commands(text, marked="run"), "test -s out/report.html"], own)
    lines = [line.replace("git clone URL", f"git clone -q '{source}'") for line in commands(text)]
    steps = (
        read_along(page, cells(page, text), tree / ".venv" / "bin" / "python", own) if page != FIRST else []
    )
    if lines and not any(step.code for step in steps):
        enter = [] if page == FIRST else [f". '{tree}/.venv/bin/activate'"]
        steps += follow(page, [*enter, *lines], own)
    return steps


def main() -> int:
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--pages", nargs="+", default=PAGES, metavar="PAGE", help="which; all when left out")
    parser.add_argument("--source", type=Path, default=ROOT, help="the repository that is cloned")
    parser.add_argument("--keep", type=Path, help="do it in this new folder, and keep it")
    parser.add_argument("--json", type=Path, help="file for the steps")
    given = parser.parse_args()
    steps: list[Step] = []
    with tempfile.TemporaryDirectory() as gone:
        place = (given.keep or Path(gone)).absolute()
        place.mkdir(parents=True, exist_ok=True)
        for page in given.pages:
            found = trial(page, place, given.source.absolute())
            steps += found
            print(f"\n{page}: {sum(s.wall for s in found):.0f} s, {sum(s.cpu for s in found):.0f} s of CPU")
            passed = 0.0
            for step in found:
                passed += step.wall
                name = step.line.split("#")[0].strip()
                goal = GOALS.get(name) if page == FIRST else None
                print(
                    f"{step.wall:8.1f} {step.cpu:8.1f}  {name[:100]}"
                    + (f"  FAILED {step.code}" if step.code else "")
                )
                if goal is not None:
                    print(f"{passed:8.1f} s until here; the goal is {goal:.0f} s")
            sys.stdout.flush()
    if given.json:
        given.json.write_text(json.dumps([asdict(step) for step in steps], indent=1) + "\n", encoding="utf-8")
    return int(any(step.code for step in steps))


if __name__ == "__main__":
    sys.exit(main())
