"""Words of the glossary lead to it: the first time that a page uses one, outside of code, titles and links."""

from __future__ import annotations

import re
from collections.abc import Iterable
from pathlib import Path

GLOSSARY = Path(__file__).with_name("glossary.md")

COMMON = {"bounce", "capture", "creep", "flip", "fold", "ledger", "play", "pull", "release", "slot", "source"}
"""Entries whose words are used in passing as well."""


def entries() -> list[str]:
    """Words that the glossary explains, those of one entry next to one another."""
    heads = re.findall(r"^(.+)\n: ", GLOSSARY.read_text(encoding="utf-8"), re.MULTILINE)
    return [word for head in heads for word in head.split(", ")]


def place(word: str) -> str:
    """Name of the place of an entry on the glossary's page."""
    return "term-" + re.sub(r"\W+", "-", word.lower())


def pattern(words: Iterable[str]) -> re.Pattern[str]:
    """Finds words, also as plurals; longer ones first."""
    return re.compile(rf"\b({'|'.join(map(re.escape, sorted(words, key=len, reverse=True)))})s?\b", re.IGNORECASE)


def link_words(app, tree, page) -> None:
    """Give the entries places, and link the first use of each on another page."""
    from docutils import nodes

    if page.startswith("generated/"):
        return
    if page == "glossary":
        for term in tree.findall(nodes.term):
            term["ids"] += [place(word) for word in term.astext().split(", ")]
        return
    open_words = {word.lower(): word for word in entries() if word not in COMMON}
    closed = (nodes.literal, nodes.literal_block, nodes.reference, nodes.title, nodes.raw, nodes.caption, nodes.math)
    for text in list(tree.findall(nodes.Text)):
        parent, kin = text.parent, text.parent
        while kin is not None and not isinstance(kin, closed):
            kin = kin.parent
        if kin is not None or not open_words:
            continue
        new, rest = [], text.astext()
        while open_words and (found := pattern(open_words).search(rest)):
            word = open_words.pop(found[1].lower())
            target = f"{app.builder.get_relative_uri(page, 'glossary')}#{place(word)}"
            new += [nodes.Text(rest[: found.start()]), nodes.reference("", found[0], refuri=target, internal=True)]
            rest = rest[found.end() :]
        if new:
            parent.replace(text, [*new, nodes.Text(rest)])


def setup(app) -> dict[str, bool]:
    """Link when pages are written."""
    app.connect("doctree-resolved", link_words)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
