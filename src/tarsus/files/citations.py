"""What to cite for a run, as BibTeX: the library, the sources of its scene, and those of its laws."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING

from tarsus.files.version import package_version
from tarsus.model.laws.base import Law

if TYPE_CHECKING:
    from tarsus.model.scene import Scene

_SPECIAL = re.compile(r"([&%$#_{}])")
"""Characters that mean something to LaTeX."""


def bibtex(scene: Scene) -> str:
    """BibTeX entries of all that a run of a scene rests on, each once.

    Parameters
    ----------
    scene
        Its ``citations`` are taken, and the ``source`` of every law of its ground that has one.

    Returns
    -------
    str
        An entry for the library with its version, then one for each source. Sources are plain sentences: where one
        says "Title, what it is, where", its first part is the title, and the whole is the note.
    """
    entries = [
        f"@software{{tarsus,\n  author = {{{{The Tarsus developers}}}},\n"
        "  title = {Tarsus: contact dynamics of legged piezoelectric micro-robots},\n"
        f"  version = {{{package_version()}}}\n}}"
    ]
    said = dict.fromkeys([*scene.citations, *(law.source for law in _laws(scene) if law.source)])
    whole = [one for one in said if not any(other != one and other.startswith(one.rstrip(".")) for other in said)]
    for number, source in enumerate(whole, 1):
        title, _, rest = source.rstrip(".").partition(", ")
        kind = "phdthesis" if "dissertation" in rest else "misc"
        year = re.search(r"\b(19|20)\d\d\b", rest)
        lines = [f"title = {{{_escaped(title)}}}", f"note = {{{_escaped(source)}}}"]
        lines += [f"year = {{{year[0]}}}"] if year else []
        entries.append(f"@{kind}{{tarsus-source-{number},\n  " + ",\n  ".join(lines) + "\n}")
    return "\n\n".join(entries) + "\n"


def _laws(scene: Scene) -> list[Law]:
    """Every law of the ground, those in fields of their own and those among ``ground.laws``."""
    own = [getattr(scene.ground, name) for name in type(scene.ground).model_fields]
    return [one for one in (*own, *scene.ground.laws.values()) if isinstance(one, Law)]


def _escaped(text: str) -> str:
    return _SPECIAL.sub(r"\\\1", text)
