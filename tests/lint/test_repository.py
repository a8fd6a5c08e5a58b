"""README, CI and documentation say the same thing as the files they speak of."""

from __future__ import annotations

import os
import re
import tomllib
from pathlib import Path

import pytest

from heavy import declared

ROOT = Path(__file__).parents[2]
README = (ROOT / "README.md").read_text(encoding="utf-8")
PAGES = [ROOT / "README.md", ROOT / "CONTRIBUTING.md", *sorted((ROOT / "docs").glob("*.md"))]


def test_the_readme_has_exactly_two_set_up_commands_and_ci_takes_its_tests_from_there():
    marked = re.findall(r"<!-- command: (\w+) -->\n```bash\n(.+)\n```", README)
    assert [name for name, _ in marked] == ["run", "test"]
    assert len(re.findall(r"^```bash$", README, re.MULTILINE)) == 2
    for _, command in marked:
        assert "\n" not in command and "-c constraints.txt" in command
    script = (ROOT / ".ci" / "run").read_text(encoding="utf-8")
    assert 'step "README, tests" readme test' in script and 'readme_command "$1"' in script
    assert os.access(ROOT / ".ci" / "run", os.X_OK)


def test_every_lane_is_run_by_one_of_the_two_scripts():
    options = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["tool"]["pytest"]["ini_options"]
    scripts = "".join((ROOT / ".ci" / name).read_text(encoding="utf-8") for name in ("run", "all"))
    for lane in declared():
        assert f"not {lane}" in options["addopts"], f"{lane} runs by default"
        assert re.search(rf"(-m|PYTEST}}) \"?(\w+ or )*{lane}\b", scripts), f"no script of .ci runs {lane}"


def test_the_list_of_heavy_tests_names_tests():
    listed = (ROOT / "tests" / "heavy.txt").read_text(encoding="utf-8").splitlines()
    assert listed == sorted(set(listed))
    sources = {}
    for case in listed:
        file, *_, function = case.split("[")[0].split("::")
        text = sources.setdefault(file, (ROOT / "tests" / file).read_text(encoding="utf-8"))
        assert re.search(rf"^\s*(async )?def {function}\(", text, re.MULTILINE), case


def test_constraints_pin_every_dependency_and_no_place():
    text = (ROOT / "constraints.txt").read_text(encoding="utf-8")
    pinned = {line.split("==")[0].lower() for line in text.splitlines() if "==" in line}
    assert "://" not in text and "@" not in text
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    wanted = [*project["dependencies"], *project["optional-dependencies"]["test"]]
    names = {re.split(r"[<>=\[~!; ]", one)[0].lower() for one in wanted}
    assert names <= pinned


def test_the_law_in_contributing_is_the_example():
    law = (ROOT / "examples" / "laws" / "magnet.py").read_text(encoding="utf-8")
    for page in ("CONTRIBUTING.md", "docs/add-a-law.md"):
        assert f"```python\n{law}```" in (ROOT / page).read_text(encoding="utf-8"), page


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_links_between_pages_lead_somewhere(page):
    text = page.read_text(encoding="utf-8")
    for target in re.findall(r"\]\(([^)#:]+?)(?:#[^)]*)?\)", text):
        assert (page.parent / target).exists(), f"{page.name} links to {target}"


def test_every_erratum_that_can_be_computed_has_a_test():
    tests = "".join(path.read_text(encoding="utf-8") for path in (ROOT / "tests" / "errata").glob("test_*.py"))
    page = (ROOT / "docs" / "errata.md").read_text(encoding="utf-8")
    listed = {int(number) for number in re.findall(r"^### E(\d+):", page, re.MULTILINE)}
    tested = {int(number) for number in re.findall(r"def test_e(\d+)_", tests)}
    assert listed == set(range(1, 17))
    # E1 and E13 are about wording.
    assert listed - tested == {1, 13}
