"""Links of the built pages: what they point to is there, nothing comes from elsewhere, pages of names say something;
words that readers look for are in the index of the search, and lead to the glossary.

python docs/check_links.py docs/_build/html
"""

from __future__ import annotations

import json
import sys
from functools import cache
from html.parser import HTMLParser
from pathlib import Path
from urllib.parse import unquote, urlsplit

LOADED = {"script": "src", "img": "src", "link": "href", "source": "src", "iframe": "src"}
"""Tags whose targets a browser fetches by itself, which must not need the network."""
SOUGHT = ("adhes", "impact", "veloc", "mujoco", "slurm")
"""Stems that the search must find."""
TERMS = (
    "chatter",
    "zeno-behaviour",
    "pull-in",
    "pull-out",
    "pull-off",
    "stiction",
    "sticking-velocity",
    "contact-ageing",
    "dwell-time",
    "pareto-front",
    "impact-law",
    "cor",
)
"""Entries of the glossary that some page must lead to."""


class Page(HTMLParser):
    """Targets of a page, those that are fetched by themselves, and places in it that can be pointed to."""

    def __init__(self, file: Path) -> None:
        super().__init__()
        self.links: list[str] = []
        self.loaded: list[str] = []
        self.places: set[str] = set()
        self.feed(file.read_text(encoding="utf-8"))

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        given = dict(attrs)
        self.places |= {one for one in (given.get("id"), given.get("name")) if one}
        if tag == "a" and given.get("href"):
            self.links.append(str(given["href"]))
        target = given.get(LOADED.get(tag, ""))
        if target and given.get("rel") not in ("canonical", "next", "prev"):
            self.loaded.append(target)


def broken(folder: Path) -> list[str]:
    """What is wrong, one sentence each."""
    page = cache(Page)
    found = [
        f"{file.relative_to(folder)} describes nothing"
        for file in sorted((folder / "generated").glob("*.html"))
        if 'class="sig ' not in file.read_text(encoding="utf-8")
    ]
    for file in sorted(folder.rglob("*.html")):
        if "_static" in file.parts:
            continue
        name = file.relative_to(folder)
        found += [
            f"{name} loads {one} from the network"
            for one in page(file).loaded
            if urlsplit(one).scheme not in ("", "data")
        ]
        for link in {*page(file).links, *page(file).loaded}:
            parts = urlsplit(link)
            if parts.scheme or parts.netloc:
                continue
            target = (file.parent / unquote(parts.path)).resolve() if parts.path else file.resolve()
            if target.is_dir():
                target /= "index.html"
            if not target.exists():
                found.append(f"{name} points to {link}, which is not there")
            elif parts.fragment and target.suffix == ".html" and unquote(parts.fragment) not in page(target).places:
                found.append(f"{name} points to {link}, a place that is not there")
    index = json.loads((folder / "searchindex.js").read_text(encoding="utf-8")[len("Search.setIndex(") : -1])
    found += [
        f"the search does not find {stem}" for stem in SOUGHT if not {stem} & {*index["terms"], *index["titleterms"]}
    ]
    linked = {
        link.rpartition("#term-")[2] for file in folder.glob("*.html") for link in page(file).links if "#term-" in link
    }
    return found + [f"no page leads to {term} in the glossary" for term in TERMS if term not in linked]


if __name__ == "__main__":
    wrong = broken(Path(sys.argv[1]))
    print("\n".join(wrong) or "all links lead somewhere")
    sys.exit(bool(wrong))
