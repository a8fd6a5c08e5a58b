"""Who imports whom, file by file: no circles, no package's files through its own list of names, short chains."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from functools import cache
from graphlib import CycleError, TopologicalSorter
from pathlib import Path

SOURCES = Path(__file__).parents[2] / "src"
LONGEST = 20
"""Modules of the longest chain of imports, from a page of the reproduction down to the one exception: it only becomes
shorter. What is imported where it is used, or for types alone, does not count."""


def _name(file: Path) -> str:
    parts = file.relative_to(SOURCES).with_suffix("").parts
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


FILES = {_name(file): file for file in sorted(SOURCES.rglob("*.py"))}
Import = tuple[str, ...]


@cache
def tree(module: str) -> ast.Module:
    return ast.parse(FILES[module].read_text(encoding="utf-8"))


def _for_types(node: ast.stmt) -> bool:
    return isinstance(node, ast.If) and "TYPE_CHECKING" in ast.dump(node.test)


def _statements(body: list[ast.stmt], *, late: bool) -> Iterator[ast.Import | ast.ImportFrom]:
    """Imports when a module is loaded; with ``late`` those within functions as well. Never those for types alone."""
    for node in body:
        if isinstance(node, (ast.Import, ast.ImportFrom)):
            yield node
        elif isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef) and not late:
            continue
        elif not _for_types(node):
            for part in ("body", "orelse", "handlers", "finalbody"):
                yield from _statements(getattr(node, part, []), late=late)


@cache
def imported(module: str, late: bool = False) -> frozenset[str]:
    """Modules of ours that a module names when it imports."""
    found: set[str] = set()
    for node in _statements(tree(module).body, late=late):
        if isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names}
            continue
        for alias in node.names:
            full = f"{node.module}.{alias.name}"
            found.add(full if full in FILES else str(node.module))
    return frozenset(found & FILES.keys()) - {module}


@cache
def chain(module: str) -> tuple[str, ...]:
    """The longest way down from a module."""
    return (module, *max((chain(one) for one in imported(module)), key=len, default=()))


def test_no_circle_of_files_at_all():
    try:
        tuple(TopologicalSorter({module: imported(module, late=True) for module in FILES}).static_order())
    except CycleError as error:
        raise AssertionError(" -> ".join(error.args[1])) from None


def test_no_file_imports_from_the_list_of_its_own_package():
    packages = {name for name, file in FILES.items() if file.name == "__init__.py"} - {"tarsus"}
    wrong = [
        f"{module} imports from {one}"
        for module in FILES.keys() - packages
        for one in imported(module, late=True) & packages
        if module.startswith(f"{one}.") and not _compiled(module, one)
    ]
    assert wrong == []


def _compiled(module: str, package: str) -> bool:
    """Whether all that a module imports from its package are modules in machine code, which are no files of ours."""
    names = [
        alias.name
        for node in _statements(tree(module).body, late=True)
        if isinstance(node, ast.ImportFrom) and node.module == package
        for alias in node.names
        if f"{package}.{alias.name}" not in FILES
    ]
    return all(name in ("_native", "_linear") for name in names)


def test_chains_of_imports_are_short():
    longest = max((chain(module) for module in FILES), key=len)
    assert len(longest) <= LONGEST, " -> ".join(longest)
