"""Plain English in the docs and in messages: short sentences, short pages, the field's words and not our own."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator
from pathlib import Path
from statistics import fmean

import pytest

import tarsus

ROOT = Path(__file__).parents[2]
DOCS = ROOT / "docs"
PAGES = [
    *sorted(DOCS.glob("*.md")),
    *(ROOT / f"{name}.md" for name in ("README", "CONTRIBUTING", "SUPPORT", "CODE_OF_CONDUCT")),
]
SOURCES = [file for room in ("tarsus", "tarsus_reproduce") for file in sorted((ROOT / "src" / room).rglob("*.py"))]

LONGEST = 30
"""Words of a sentence: longer ones are read twice (plain-language guides say 25 to 30)."""
MEAN = 16.0
"""Words of a sentence on average, on the pages that somebody reads with a task in hand."""
TASK = 600
"""Words of a page that somebody reads with a task in hand, with tables and without code."""
PAGE = 1500
"""Words of a page, with code and tables: five minutes of reading."""
ALL = 32_000
"""Words of README and all pages of docs."""
BEFORE = 80
"""Words before the first code of a page that somebody reads with a task in hand."""
REFERENCE = {"file-format.md"}
"""Pages that are looked things up in, key by key, and may be longer."""

GONE = {
    r"told|tells|telling": "determined, measured, reported, stated",
    r"beside": "with, compared with, next to",
    r"put down": "placed, released",
    r"felt|feels": "sensed, acts on",
    r"drawn along": "propagated",
    r"taken off": "corrected",
    r"hangs? on|hang together": "depends on, correlated",
    r"nudged": "perturbed",
    r"impact maps?": "impact law",
    r"latch(es)?": "adhesive hold",
    r"let go|lets go": "released",
    r"blows?": "impact",
    r"one's own": "your own",
    r"(?<!cut )off by|off one|(?<=% )off|off (?=together)": "error, deviation, wrong by",
    r"hurt|hurts|hurting": "worst, adds to",
    r"rooms?(?= of| below| above|s? are)": "package",
    r"nobody knows": "unknown, randomised",
    r"no number of the scene": "not a number in this scene",
}
"""Words that are not used any more -> what the field says."""
NAMED = {"glossary.md": {"latch", "impact map"}}
"""Pages that say what a word means elsewhere."""

_CODE = re.compile(r"^```.*?^```$", re.DOTALL | re.MULTILINE)
_COMMENT = {
    True: re.compile(r'"""[\s\S]*?"""|(?:^ *#.*\n)+|#.*', re.MULTILINE),
    False: re.compile(r"/\*[\s\S]*?\*/|(?:^ *//.*\n)+|//.*", re.MULTILINE),
}
_END = re.compile(r"(?<=[.!?:])\)? +(?=[\"(]?[A-Z0-9])|(?<=:) ")
_ANY = re.compile(rf"\b(?:{'|'.join(GONE)})\b", re.IGNORECASE)
_SHORT = re.compile(r"\b(Figs?|Eqs?|No|e\.g|i\.e|cf|vs|Sec|al)\.")


def plain(page: Path) -> str:
    """A page without code, tables, headings, formulas and addresses of links."""
    text = _CODE.sub("\n\n", page.read_text(encoding="utf-8"))
    text = re.sub(r"<!--.*?-->", "", text, flags=re.DOTALL)
    text = re.sub(r"\$\$.*?\$\$", " E ", text, flags=re.DOTALL)
    text = re.sub(r"^(\|.*|#.*)$", "\n", text, flags=re.MULTILINE)
    text = re.sub(r"!\[[^\]]*\]\([^)]*\)", "", re.sub(r"\$[^$]+\$", "E", re.sub(r"`[^`]+`", "Code", text)))
    return re.sub(r"\[([^\]]*)\]\([^)]*\)", r"\1", text)


def lengths(text: str) -> Iterator[tuple[int, str]]:
    """Sentences with their numbers of words; an item of a list is at least one."""
    items = re.sub(r"^ *(?:[-*:]|\d+\.) +", "\n\n", _SHORT.sub(r"\1", re.sub(r"\*+", "", text)), flags=re.MULTILINE)
    for block in re.split(r"\n\s*\n", items):
        for sentence in _END.split(" ".join(block.split())):
            if count := sum(bool(re.search(r"\w", word)) for word in sentence.split()):
                yield count, sentence


def gone(text: str) -> list[str]:
    """Words that are not used any more, each with what is said instead."""
    if not _ANY.search(text):
        return []
    return [
        f"{found[0].lower()}: {instead}"
        for words, instead in GONE.items()
        for found in re.finditer(rf"\b(?:{words})\b", text, re.IGNORECASE)
    ]


def messages(file: Path) -> Iterator[tuple[int, str]]:
    """Texts of four words and more in a source, with their lines: messages, labels and help, no docstrings."""
    nodes = list(ast.walk(ast.parse(file.read_text(encoding="utf-8"))))
    parts, said = set[int](), set[int]()
    for node in nodes:
        if isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant):
            said.add(id(node.value))
        if isinstance(node, ast.JoinedStr):
            parts.update(map(id, node.values))
    for node in nodes:
        if isinstance(node, ast.JoinedStr):
            text = "".join(str(one.value) if isinstance(one, ast.Constant) else "X" for one in node.values)
        elif isinstance(node, ast.Constant) and isinstance(node.value, str) and id(node) not in parts | said:
            text = node.value
        else:
            continue
        if len(text.split()) >= 4:
            yield node.lineno, text


def long(text: str) -> list[str]:
    """Sentences of a message that are too long; a semicolon and the end of a line end one."""
    if len(text.split()) <= LONGEST:
        return []
    return [one for count, one in lengths(re.sub(r"[;\n]", "\n\n", text)) if count > LONGEST]


def pages_of(*kinds: str) -> set[str]:
    """Pages under the index's captions."""
    trees = re.findall(r":caption: (.*?)\n\n(.*?)```", (DOCS / "index.md").read_text(encoding="utf-8"), re.DOTALL)
    return {f"{name}.md" for caption, names in trees if caption in kinds for name in names.split()}


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_a_page_is_short_its_sentences_are_and_it_uses_the_field_s_words(page: Path) -> None:
    assert [one for one in gone(plain(page)) if one.split(":")[0] not in NAMED.get(page.name, ())] == []
    counted = list(lengths(plain(page)))
    assert [sentence for count, sentence in counted if count > LONGEST] == []
    typed = page.read_text(encoding="utf-8")
    if page.name in pages_of("Tutorials", "How to") | {"README.md"}:
        assert fmean(count for count, _ in counted) <= MEAN
    if page.name in pages_of("How to"):
        bare = re.sub(r"<!-- figures:.*?<!-- end -->", "", _CODE.sub("", typed), flags=re.DOTALL)
        assert sum(bool(re.search(r"\w", word)) for word in bare.split()) <= TASK
        assert len(typed.split("```")[0].split()) <= BEFORE
    if page.parent == DOCS and page.name not in REFERENCE:
        assert len(typed.split()) <= PAGE


def test_the_manual_is_short() -> None:
    assert (
        sum(len(page.read_text(encoding="utf-8").split()) for page in (*DOCS.glob("*.md"), ROOT / "README.md")) <= ALL
    )


# Slow: all sources are parsed.
@pytest.mark.full
def test_messages_are_short_and_use_the_field_s_words() -> None:
    wrong = [
        f"{file.relative_to(ROOT)}:{line}: {fault}"
        for file in SOURCES
        for line, text in messages(file)
        for fault in (*gone(text), *long(text))
    ]
    assert wrong == []


def comments(file: Path) -> Iterator[tuple[int, str]]:
    """Comments and docstrings of a source, with their lines; lines of a comment that follow each other are one."""
    text = file.read_text(encoding="utf-8")
    for found in _COMMENT[file.suffix == ".py"].finditer(text):
        yield text.count("\n", 0, found.start()) + 1, re.sub(r"\s+(?:#|//)?\s*", " ", found[0])


def test_names_comments_and_docstrings_use_the_field_s_words() -> None:
    assert [name for name in tarsus.__all__ if gone(name.replace("_", " "))] == []
    files = [file for end in ("py", "hpp", "cpp", "js") for file in (ROOT / "src").rglob(f"*.{end}")]
    read = [(file, *one) for file in files if "vendor" not in file.parts for one in comments(file)]
    assert len(read) > 5000
    assert [f"{file.relative_to(ROOT)}:{line}: {word}" for file, line, text in read for word in gone(text)] == []


def test_a_long_sentence_and_a_word_of_our_own_are_found(tmp_path: Path) -> None:
    page, source = tmp_path / "page.md", tmp_path / "source.py"
    page.write_text(f"# Put down\n\n{31 * 'word '}end. It is short.\n\n`told` told\n\n| felt |\n", encoding="utf-8")
    assert [count for count, _ in lengths(plain(page))] == [32, 3, 2]
    assert gone(plain(page)) == ["told: determined, measured, reported, stated"]
    source.write_text(
        '"""Told in a docstring, which is another thing."""\nx = f"{1} was put down here"\n', encoding="utf-8"
    )
    ((line, text),) = messages(source)
    assert line == 2 and gone(text) == ["put down: placed, released"]
    source.write_text("x = 1  # put\n# nothing is put\n# down\n", encoding="utf-8")
    assert [(line, gone(text)) for line, text in comments(source)] == [(1, []), (2, ["put down: placed, released"])]
