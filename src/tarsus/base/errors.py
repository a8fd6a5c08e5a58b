"""The one exception that bad input raises."""

from __future__ import annotations

from collections.abc import Iterable


class InputError(ValueError):
    """Input that cannot be used; every problem found is listed, each as one sentence.

    Parameters
    ----------
    problems
        One sentence, or several.

    Attributes
    ----------
    problems : list[str]
        The sentences, in the order found.  ``str(error)`` joins them with newlines.
    """

    def __init__(self, problems: str | Iterable[str]) -> None:
        self.problems: list[str] = [problems] if isinstance(problems, str) else list(problems)
        super().__init__("\n".join(self.problems))

    def __reduce__(self) -> tuple[type[InputError], tuple[list[str]]]:
        return type(self), (self.problems,)
