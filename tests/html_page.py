"""A report page as a test reads it."""

from __future__ import annotations

import re
from html.parser import HTMLParser

VOID = {"meta", "br", "wbr", "link", "img", "hr", "input"}


class Page(HTMLParser):
    """Checks nesting, collects tags, attributes and text."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.open: list[str] = []
        self.tags: list[str] = []
        self.attributes: list[tuple[str, str, str]] = []
        self.words: list[str] = []
        self.feed(text)
        self.close()
        assert not self.open, f"not closed: {self.open}"

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.append(tag)
        self.attributes += [(tag, name, value or "") for name, value in attrs]
        if tag not in VOID:
            self.open.append(tag)

    def handle_startendtag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.append(tag)
        self.attributes += [(tag, name, value or "") for name, value in attrs]

    def handle_endtag(self, tag: str) -> None:
        if tag not in VOID:
            assert self.open.pop() == tag

    def handle_data(self, data: str) -> None:
        if self.open and self.open[-1] not in ("style", "script"):
            self.words.append(data)

    @property
    def text(self) -> str:
        return " ".join(" ".join(self.words).split())


def alone(text: str) -> Page:
    """A page, which is one file: it asks nothing of any network, every name in it is its own, what it refers to is in
    it, and its figures are numbered."""
    page = Page(text)
    assert not {"link", "img", "object"} & set(page.tags)
    ids = [value for _, name, value in page.attributes if name == "id"]
    assert len(ids) == len(set(ids))
    names = {value for tag, name, value in page.attributes if name.endswith("href") and tag != "a"}
    names |= {value for tag, name, value in page.attributes if (tag, name) == ("a", "href") and value.startswith("#")}
    names |= {mark for _, _, value in page.attributes for mark in re.findall(r"url\(([^)]+)\)", value)}
    assert {name.removeprefix("#") for name in names} <= set(ids)
    assert all(value.startswith("#") for _, name, value in page.attributes if name == "src")
    for word in ("@import", "fetch(", "XMLHttpRequest", "WebSocket", "import(", "sendBeacon", "eval("):
        assert word not in text, word
    numbers = [int(one) for one in re.findall(r"<b>Figure (\d+)\.</b>", text)]
    assert numbers == list(range(1, len(numbers) + 1))
    return page
