"""Lists of names of the reference: `.. names:: tarsus.fit` is a table of all that the package offers.

A name is listed where it is offered, in `tarsus/__init__.pyi` or in the `__all__` of its package, and nowhere again.
`.. names:: tarsus Nouns` takes the names of the stub below the comment that begins so. Sphinx writes a page for each
name of the lists that it finds on disk, so that they are written into one file there before it looks.
"""

from __future__ import annotations

import re
from importlib import import_module
from pathlib import Path
from types import ModuleType

DOCS = Path(__file__).parent
LISTS = DOCS / "names.rst"
"""Made at every build; no page of its own."""

HEAD = ".. autosummary::\n   :toctree: generated\n   :nosignatures:\n"


def names_of(words: str) -> list[str]:
    """Full names of what a package offers, but its modules; of `tarsus` those of one part of the stub."""
    package, _, part = words.partition(" ")
    if part:
        stub = (DOCS.parent / "src" / "tarsus" / "__init__.pyi").read_text(encoding="utf-8")
        block = stub[stub.index(f"# {part}") :].split("\n\n")[0]
        found = []
        for home, names in re.findall(r"^from (\S+) import (.*)$", block, re.MULTILINE):
            for own, name in re.findall(r"(\w+) as (\w+)", names):  # a verb that is a room too is its function
                found.append(f"{home}.{own}" if home.startswith(f"{package}.{name}.") else f"{package}.{name}")
        return found
    module, top = package_of(package), import_module("tarsus")
    offered = {name: getattr(module, name) for name in module.__all__}
    at_top = {name for name, one in offered.items() if name in top.__all__ and getattr(top, name) is one}
    return [
        f"tarsus.{name}" if name in at_top else f"{package}.{name}"  # one page for an object
        for name, one in offered.items()
        if not isinstance(one, ModuleType)
    ]


def package_of(name: str) -> ModuleType:
    """A package, also by the name that it has at the top, such as `tarsus.laws`."""
    try:
        return import_module(name)
    except ModuleNotFoundError:
        parent, _, own = name.rpartition(".")
        return getattr(import_module(parent), own)


def listed(page: str) -> list[str]:
    """All names that a page lists, by `autosummary` or by `names`, in its order."""
    found: list[str] = []
    for words, name in re.findall(r"^\.\. names:: (.*)$|^   (tarsus\S*)$", page, re.MULTILINE):
        found += names_of(words) if words else [name]
    return list(dict.fromkeys(found))


def write_lists() -> None:
    """Write what `api.md` lists where Sphinx will look for it."""
    names = listed((DOCS / "api.md").read_text(encoding="utf-8"))
    text = "\n".join([":orphan:\n", HEAD, *(f"   {name}" for name in names), ""])
    if not LISTS.is_file() or LISTS.read_text(encoding="utf-8") != text:
        LISTS.write_text(text, encoding="utf-8")


def setup(app) -> dict[str, bool]:
    """Add the directive."""
    from docutils.statemachine import StringList
    from sphinx.ext.autosummary import Autosummary

    class Names(Autosummary):
        """A table of all names that a package offers."""

        required_arguments, final_argument_whitespace = 1, True

        def run(self):
            self.options |= {"toctree": "generated", "nosignatures": None}
            self.content = StringList(names_of(self.arguments[0]), source="names")
            return super().run()

    app.add_directive("names", Names)
    return {"parallel_read_safe": True}
