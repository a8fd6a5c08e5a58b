"""A function as its file declares it: purpose, arguments and what is said of them. Nothing is loaded for it."""

from __future__ import annotations

import ast
import re
from dataclasses import dataclass
from functools import cached_property
from importlib.util import find_spec
from pathlib import Path
from textwrap import dedent
from typing import Any

NO_DEFAULT = object()
"""Of an argument that has to be given."""

_OF_PYTHON = re.compile(r"; in Python .*?(?=\.(?: |$))")
"""What a docstring says of an argument that a command line cannot take."""
_PACKAGES = Path(__file__).parents[2]


def _plain(text: str) -> str:
    """A paragraph of a docstring on one line."""
    return " ".join(dedent(text).split()).replace("``", "`")


@dataclass(frozen=True)
class Argument:
    """An argument: its name, its type as written, without "| None", its default, what the docstring says of it, and
    whether it is any number of words."""

    name: str
    type: str
    default: Any
    said: str
    many: bool = False


@dataclass(frozen=True)
class Declaration:
    """A function or another name of a module, by "package.module:name"."""

    home: str

    @property
    def name(self) -> str:
        """Its name in the module."""
        return self.home.partition(":")[2]

    @cached_property
    def _text(self) -> str:
        module = self.home.partition(":")[0]
        file = _PACKAGES.joinpath(*module.split(".")).with_suffix(".py")
        if not file.is_file():
            spec = find_spec(module)
            if spec is None or spec.origin is None:
                raise ImportError(f"there is no module {module}")
            file = Path(spec.origin)
        return file.read_text(encoding="utf-8")

    @cached_property
    def _function(self) -> ast.FunctionDef | None:
        """The last definition of the name, behind its overloads; None where it names a value."""
        begins = list(re.finditer(rf"^def {self.name}\(", self._text, re.MULTILINE))
        if not begins:
            return None
        text = self._text[begins[-1].start() :]
        end = re.search(r"\n(?=[^\s)#])", text)
        found = ast.parse(text[: end.start()] if end else text).body[0]
        assert isinstance(found, ast.FunctionDef)
        return found

    @property
    def _doc(self) -> str:
        """The docstring of the function; of the file where the name is that of a value."""
        if self._function is not None:
            return ast.get_docstring(self._function) or ""
        if not re.search(rf"^{self.name}\b.*=", self._text, re.MULTILINE):
            raise ImportError(f"there is no {self.name} in {self.home.partition(':')[0]}")
        return ast.get_docstring(ast.parse(self._text)) or ""

    @property
    def purpose(self) -> str:
        """What is said before the arguments, a line a paragraph."""
        said = self._doc.partition("\n\nParameters\n----------\n")[0].partition("\n\nRaises\n------\n")[0]
        return "\n\n".join(map(_plain, said.split("\n\n")))

    @property
    def sentence(self) -> str:
        """The first paragraph, as a sentence."""
        said = " ".join(self._doc.split("\n\n")[0].split()).removeprefix(f"`tarsus {self.name}`: ")
        return said[:1].upper() + said[1:]

    @cached_property
    def said(self) -> dict[str, str]:
        """What the docstring says of each argument, less what is said of Python."""
        part = self._doc.partition("\n\nParameters\n----------\n")[2]
        part = re.split(r"\n\n\w+\n-{4,}\n", part)[0]
        found = {}
        for names, text in re.findall(r"^(\*?\w[\w, *]*)\n((?:    .*(?:\n|\Z)|\n)+)", part, re.MULTILINE):
            for name in names.split(","):
                found[name.strip(" *")] = _OF_PYTHON.sub("", _plain(text))
        return found

    @property
    def arguments(self) -> tuple[Argument, ...]:
        """In their order, but those that take any name."""
        assert self._function is not None
        taken = self._function.args
        places = [*taken.posonlyargs, *taken.args]
        defaults = [None] * (len(places) - len(taken.defaults)) + list(taken.defaults)
        several = [] if taken.vararg is None else [(taken.vararg, None)]
        pairs = [*zip(places, defaults, strict=True), *several, *zip(taken.kwonlyargs, taken.kw_defaults, strict=True)]
        return tuple(
            Argument(
                one.arg,
                ast.unparse(one.annotation).removesuffix(" | None") if one.annotation else "",
                NO_DEFAULT if default is None else self._value(default),
                self.said.get(one.arg, ""),
                one is taken.vararg,
            )
            for one, default in pairs
        )

    def _value(self, default: ast.expr) -> Any:
        """A default: a literal, or the name of one at the top of the file; None of any other, which is left alone."""
        if isinstance(default, ast.Name):
            given = re.search(rf"^{default.id}(?:: [^=]+)? = (.+)$", self._text, re.MULTILINE)
            default = ast.parse(given[1] if given else "None", mode="eval").body
        try:
            return ast.literal_eval(default)
        except ValueError:
            return None
