"""The tutorials: run from top to bottom in a kernel of their own, a number from each is right."""

from __future__ import annotations

import re
from pathlib import Path

import nbformat
import pytest
from PIL import Image

NOTEBOOKS = Path(__file__).parents[2] / "docs" / "notebooks"

CLAIMS = {
    "experimentalist": (
        "assert verdicts['ground.restitution.coefficient'].word == 'determined'\n"
        "assert abs(restitution / ts.get_value(hidden, 'ground.restitution.coefficient') - 1.0) < 0.03\n"
        "assert abs(error) < 0.02 and np.median(missed) < 0.02 and len(repr(found)) < 200"
    ),
    "designer": (
        "assert 0.5 < far.measures['mean_speed'].value < 0.7 and run.ledger.closure < 1e-8\n"
        "assert batch.measure('mean_speed').argmax() == 5 and '_TICKS' in header.upper()"
    ),
    "walker": (
        "assert walk.ledger.closure < 1e-8 and 5e-5 < walk.measures['mean_speed'].value < 8e-5\n"
        "assert 0.0 < slip < 0.1 and speeds.min() > 0.0 and picture.stat().st_size < 3e5"
    ),
    "theorist": (
        "assert abs(flip - theory) < 1e-9 and 1.53 < moved < 1.56\n"
        "assert orbit.kind == 'stable, period 1, 1 impact' and np.isclose(np.prod(np.abs(orbit.multipliers)), 0.25)"
    ),
}
"""What must hold at the end of each."""


def read(name: str) -> nbformat.NotebookNode:
    return nbformat.read(NOTEBOOKS / f"{name}.ipynb", as_version=4)


def test_every_notebook_is_tested_and_in_the_table_of_contents() -> None:
    assert {file.stem for file in NOTEBOOKS.glob("*.ipynb")} == set(CLAIMS)
    index = (NOTEBOOKS.parent / "index.md").read_text(encoding="utf-8")
    assert all(f"notebooks/{name}\n" in index for name in CLAIMS)


MOST_BYTES = 300_000
"""Of a moving picture: a page of the docs holds one."""


@pytest.mark.parametrize("file", ["index.md", *(f"notebooks/{name}.ipynb" for name in CLAIMS)])
def test_the_index_and_every_notebook_open_with_a_picture_that_moves(file: str) -> None:
    docs = NOTEBOOKS.parent
    text = read(Path(file).stem).cells[0].source if file.endswith(".ipynb") else (docs / file).read_text("utf-8")
    first = [line for line in text.splitlines() if line][1]
    (target,) = re.findall(r"^!\[.+\]\((.+\.gif)\)$", first)
    picture = (docs / file).parent / target
    assert picture.stat().st_size < MOST_BYTES
    with Image.open(picture) as movie:
        assert movie.n_frames > 20 and movie.info["loop"] == 0


@pytest.mark.parametrize("name", CLAIMS)
def test_notebooks_hold_no_results_and_their_links_lead_somewhere(name: str) -> None:
    notebook = read(name)
    nbformat.validate(notebook)
    cells = [cell for cell in notebook.cells if cell.cell_type == "code"]
    assert len(cells) > 5 and not any(cell.outputs or cell.execution_count for cell in cells)
    words = "".join(cell.source for cell in notebook.cells if cell.cell_type == "markdown")
    for link in re.findall(r"\]\((\.\./[^)#]+)", words):
        assert (NOTEBOOKS / link).is_file(), f"{name}: {link}"


# Slow: a kernel starts, and gaits are searched or a campaign is identified.
@pytest.mark.full
@pytest.mark.parametrize("name", CLAIMS)
def test_notebooks_run(name: str, tmp_path: Path) -> None:
    from nbclient import NotebookClient

    notebook = read(name)
    notebook.cells.append(nbformat.v4.new_code_cell(CLAIMS[name]))
    NotebookClient(notebook, timeout=600, resources={"metadata": {"path": str(tmp_path)}}).execute()
    pictures = [out for cell in notebook.cells for out in cell.get("outputs", ()) if "image/png" in out.get("data", ())]
    assert pictures, "results are drawn"
