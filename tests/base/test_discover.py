"""Files that are found: a mistake in one is told with its name."""

from __future__ import annotations

import sys
from abc import abstractmethod
from pathlib import Path

import pytest

from tarsus.base.discover import classes_in_folder, kind_of_class
from tarsus.base.errors import InputError
from tarsus.base.spec import Description

WRONG = {
    "import nowhere": ", line 2: ModuleNotFoundError: No module named 'nowhere'",
    "x = (": ", line 2: SyntaxError: '[(]' was never closed",
    "class Mine(Shape):\n    kind: str = 'mine'": ": 'mine' lacks points",
    "class Mine(Whole):\n    kind: str = 'whole'": ": 'whole' is in shapes.base already",
}


class Shape(Description):
    """What files of a folder define."""

    @abstractmethod
    def points(self) -> int:
        """Which ones have to have."""


class Whole(Shape):
    """With all of it."""

    def points(self) -> int:
        return 1


HEAD = f"from {__name__} import Shape, Whole\n"


@pytest.mark.parametrize("text", WRONG)
def test_a_mistake_is_told_with_its_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, text: str) -> None:
    folder = tmp_path / "shapes"
    folder.mkdir()
    (folder / "__init__.py").touch()
    (folder / "base.py").write_text(f"{HEAD}class Own(Whole):\n    kind: str = 'whole'\n", encoding="utf-8")
    (folder / "mine.py").write_text(f"{HEAD}{text}\n", encoding="utf-8")
    monkeypatch.syspath_prepend(tmp_path)
    for name in ("shapes", "shapes.base", "shapes.mine"):
        monkeypatch.delitem(sys.modules, name, raising=False)
    __import__("shapes")
    with pytest.raises(InputError, match=f"mine.py{WRONG[text]}"):
        classes_in_folder("shapes", Shape, kind_of_class)
