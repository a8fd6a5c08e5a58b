"""The table that each room keeps of wrong inputs: what is asked for, where the problem is, and what is said of it.

No other test of a room looks at the words of an `InputError`.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import pytest

import tarsus as ts

Ask = Callable[[Path], object]
"""What goes wrong; it is given an empty folder."""
Said = str | Sequence[str]
"""Parts of what is said, of one sentence or of several."""


def cases(table: Mapping[str, tuple[Ask, Said]]) -> pytest.MarkDecorator:
    """The rows of a table for `is_refused`, by name."""
    return pytest.mark.parametrize(("ask", "said"), [pytest.param(*row, id=name) for name, row in table.items()])


def is_refused(ask: Ask, said: Said, folder: Path) -> ts.InputError:
    """Hold a row: every part is in the sentences, which begin with the path of their problem where one is known."""
    with pytest.raises(ts.InputError) as caught:
        ask(folder)
    text = str(caught.value)
    for part in (said,) if isinstance(said, str) else said:
        assert part in text
    for problem in caught.value.problems:
        assert problem.startswith(problem.path)
    return caught.value


def written(content: str | bytes, name: str, then: Callable[[Path], Any]) -> Ask:
    """Something that is done with a file of this content."""

    def ask(folder: Path) -> Any:
        file = folder / name
        file.write_bytes(content.encode() if isinstance(content, str) else content)
        return then(file)

    return ask
