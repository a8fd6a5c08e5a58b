"""`tarsus completion`: completion of words for a shell."""

from __future__ import annotations

from typing import Literal


def completion(shell: Literal["bash", "zsh", "fish"], /) -> int:
    """Print a script that completes verbs and options: `eval "$(tarsus completion bash)"` in ~/.bashrc.

    Parameters
    ----------
    shell
        bash, zsh or fish.
    """
    from tarsus.cli.app import build

    print(build([]).generate_completion(prog_name="tarsus", shell=shell))
    return 0
