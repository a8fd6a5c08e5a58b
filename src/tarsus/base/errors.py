"""The one exception that bad input raises, and the sentences it holds."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from enum import Enum


class Fault(Enum):
    """Kinds of problem that a caller answers otherwise than by showing them."""

    NO_CHANNEL = "a file lacks a channel"
    NO_UNIT = "nothing says the unit of a channel"
    NO_SERIES = "a file holds no time series"
    RESPONSES = "a file holds frequency responses and no time series"


class InputProblem(str):
    """One sentence on what is wrong, with its parts: callers act on these and never on the words.

    path: where, a dotted path of a description or a file ("" for all of what was given); said: the sentence without it;
    channel: of a file; channels: those of which it is said together; fault: its kind, where a caller may answer it;
    cure: what to do, in the words of Python.
    """

    def __init__(
        self,
        text: str,
        *,
        path: str = "",
        said: str = "",
        channel: str = "",
        channels: Sequence[str] = (),
        fault: Fault | None = None,
        cure: str = "",
    ) -> None:
        self.path, self.said, self.channel, self.fault, self.cure = path, said or text, channel, fault, cure
        self.channels = tuple(channels)

    def __new__(cls, text: str, **_: object) -> InputProblem:
        return super().__new__(cls, text)

    @classmethod
    def at(cls, path: str, said: str) -> InputProblem:
        """A sentence at a path, which stands before it."""
        return cls(f"{path}: {said}" if path else said, path=path, said=said)

    @classmethod
    def of_channel(cls, file: str, channel: str, said: str) -> InputProblem:
        """A sentence on a channel of a file."""
        return cls(f"{file}: channel '{channel}' {said}", path=file, said=said, channel=channel)

    def cured(self, fault: Fault, cure: str) -> str:
        """The sentence with another cure, where it is of this kind."""
        return self.removesuffix(self.cure) + cure if self.fault is fault and self.cure else self


class InputError(ValueError):
    """Input that cannot be used; every problem found is listed, each as one sentence.

    Parameters
    ----------
    problems
        One sentence, or several.

    Attributes
    ----------
    problems : list[InputProblem]
        The sentences, in the order found.  ``str(error)`` joins them with newlines.
    """

    def __init__(self, problems: str | Iterable[str]) -> None:
        given = [problems] if isinstance(problems, str) else problems
        self.problems: list[InputProblem] = [
            one if isinstance(one, InputProblem) else InputProblem(one) for one in given
        ]
        super().__init__("\n".join(self.problems))

    def __reduce__(self) -> tuple[type[InputError], tuple[list[InputProblem]]]:
        return type(self), (self.problems,)

    def has(self, fault: Fault) -> bool:
        """Whether a problem is of a kind."""
        return any(one.fault is fault for one in self.problems)
