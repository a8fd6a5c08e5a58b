"""The front page of the help. It is read from the verbs' files, none of which is loaded for it: it comes at once."""

from __future__ import annotations

import ast
import re
import shutil
from collections.abc import Callable, Mapping
from importlib.util import find_spec
from pathlib import Path
from textwrap import fill
from typing import Any, TypeVar

PURPOSE = "Contact dynamics of legged piezoelectric micro-robots, from device file to report."

OPTIONS = {"--help, -h": "Display this message and exit.", "--version": "Display application version."}

EVERYWHERE = "Every verb also takes -q (--quiet): results and errors alone; and -v (--verbose): say more."

WIDEST = 100
"""Characters a line, on a wider terminal too: longer ones are hard to follow."""


def front_page(verbs: Mapping[str, str]) -> str:
    """Usage, purpose, and a sentence for each verb."""
    width = min(shutil.get_terminal_size().columns, WIDEST)
    blocks = [f"Usage: tarsus COMMAND\n\n{fill(PURPOSE, width)}"]
    indent = 4 + max(map(len, (*verbs, *OPTIONS)))
    for title, lines in (("Commands", dict(sorted(verbs.items()))), ("Options", OPTIONS)):
        rows = [f"  {name:{indent - 2}}{said}" for name, said in lines.items()]
        blocks.append("\n".join([title, *(fill(row, width, subsequent_indent=" " * indent) for row in rows)]))
    return "\n\n".join(
        [*blocks, fill(f"tarsus COMMAND --help says what a command takes. {EVERYWHERE}", width)]
    )


WORDED = {
    "check": "inspection.show",
    "devices": "inspection.installation",
    "new": "inspection.begin",
    "plot": "report.plotted",
    "show": "inspection.show",
    "synthesize": "synthesis.verb",
}
"""Commands whose help is that of their function in Python, and the module that has it."""

F = TypeVar("F", bound=Callable[..., Any])


def worded(command: F) -> F:
    """Give a command the help of the verb of its name: the purpose, and what is said of arguments that it takes."""
    said = _docstring(_file(command.__name__), command.__name__)
    purpose, _, rest = said.partition("\n\nParameters\n----------\n")
    entries = re.findall(
        r"^(\w+)\n((?:    .*\n?|\n)+)", rest.partition("\n\nReturns\n")[0] + "\n", re.MULTILINE
    )
    taken = "".join(
        f"{name}\n    {text[:1].lower()}{text[1:]}\n"
        for name, text in ((name, " ".join(lines.split())) for name, lines in entries)
        if name in command.__annotations__
    )
    command.__doc__ = f"{purpose}\n\nParameters\n----------\n{taken}" if taken else purpose
    return command


def first_sentence(module: str, name: str) -> str:
    """First line of the docstring of a function of a module; of the module where it is no function.

    Raises
    ------
    ImportError
        When there is no such module, or nothing of that name in it.
    """
    if module == f"tarsus.cli.{name}" and name in WORDED:
        file = _file(name)
    else:
        spec = find_spec(module)
        if spec is None or spec.origin is None:
            raise ImportError(f"there is no module {module}")
        file = Path(spec.origin)
    said = _docstring(file, name).split("\n")[0].removeprefix(f"`tarsus {name}`: ")
    return said[:1].upper() + said[1:]


def _file(command: str) -> Path:
    """Where the verb of a worded command is."""
    return Path(__file__).parents[1].joinpath(*WORDED[command].split(".")).with_suffix(".py")


def _docstring(file: Path, name: str) -> str:
    """The docstring of a function in a file, which is not loaded; of the file where the name is that of a value."""
    tree = ast.parse(file.read_bytes())
    functions = {one.name: one for one in tree.body if isinstance(one, ast.FunctionDef)}
    values = {
        getattr(target, "id", None)
        for one in tree.body
        if isinstance(one, ast.Assign)
        for target in one.targets
    }
    if name not in functions and name not in values:
        raise ImportError(f"{file} has no {name}")
    return ast.get_docstring(functions.get(name, tree)) or ""
