"""`tarsus sweep`: a study into a folder, or a folder that is continued."""

from __future__ import annotations

from tarsus.cli.asked import Asked


def sweep(asked: Asked) -> int:
    """The folder of a sweep is continued, without --resume."""
    from tarsus.files.runstore import PLAN_FILE

    named, folder = asked.words["study"], asked.folder()
    assert folder is not None
    resume = asked.flag("resume")
    if (named / PLAN_FILE).exists() and asked.words["output"] is None and not asked.flag("overwrite"):
        folder, resume = named, True
    with asked.writing(folder, resume=resume), asked.calling(output=folder, resume=resume) as function:
        found = function()
        whole = hasattr(found, "file")
        written = [found.file, *asked.paged(found, folder)] if whole else []
    return asked.show(found, written)
