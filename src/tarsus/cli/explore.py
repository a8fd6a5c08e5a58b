"""`tarsus explore`: a page with the engine inside, which is compiled once where it is not there."""

from __future__ import annotations

from tarsus.cli import console
from tarsus.cli.asked import Asked


def explore(asked: Asked) -> int:
    """The page says which command line makes a run of its numbers."""
    from dataclasses import replace

    from tarsus.cli.named import texts_of
    from tarsus.solve import compiled_engine, engine_bytes

    file = asked.folder()
    assert file is not None
    asked.check(file)
    with asked.calling() as function:
        if asked.arguments and engine_bytes() is None:
            with console.spinner("compiling the engine for pages, once (a minute or two)"):
                compiled_engine()
        found = function()
        name = "" if asked.law else asked.words["scene"]
        found = replace(found, name=name, words=texts_of(asked.words["set"] or (), "--set"))
        found.write(file)
    about = {"file": str(file), "bytes": file.stat().st_size, "sliders": list(found.sliders)}
    return console.files([file], about if asked.flag("json") else None)
