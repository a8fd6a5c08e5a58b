"""The front page of the help. It is read from the verbs' files, none of which is loaded for it: it comes at once."""

from __future__ import annotations

import shutil
from collections.abc import Mapping
from textwrap import fill

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
    return "\n\n".join([*blocks, fill(f"tarsus COMMAND --help says what a command takes. {EVERYWHERE}", width)])
