"""`tarsus validate`: a published experiment, or all that are packaged, compared with what is computed of them."""

from __future__ import annotations

from typing import Annotated

from tarsus.cli.asked import Asked
from tarsus.cli.options import FLAG


def validate(asked: Asked, *, all: Annotated[bool, FLAG] = False) -> int:
    """The exit code is 1 where a claim that should hold fails, or one that is known to fail holds.

    Parameters
    ----------
    all
        Every packaged experiment; with -o into a folder of its own, with an index.
    """
    from tarsus.base.errors import InputError
    from tarsus.validation import experiment_names

    name = asked.words["name"]
    if all and name is not None:
        raise InputError(f"--all means every experiment: leave '{name}' out")
    if not all and name is None:
        raise InputError(f"name an experiment ({', '.join(experiment_names())}) or its folder, or give --all")
    return asked.carry_out()
