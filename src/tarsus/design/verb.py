"""The grammar of designs: a scene, what is free in it, what is wanted, what is kept, and what has to be borne."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from tarsus.base.errors import InputError
from tarsus.base.progress import Progress
from tarsus.base.workers import Workers
from tarsus.design.front import Design
from tarsus.design.judge import Risk
from tarsus.design.measures import DesignObjective
from tarsus.design.problem import DesignProblem, DesignSettings, problem_of
from tarsus.design.request import Given, settings_of
from tarsus.design.search import DesignSearch
from tarsus.files.library import SceneLike, as_scene
from tarsus.files.runstore import RunStore
from tarsus.files.toml import scene_texts


def design(
    scene: SceneLike | None = None,
    free: Mapping[str, Any] | Iterable[str] | None = None,
    objective: str | Sequence[str | DesignObjective] | None = None,
    limits: Any = None,
    over: Any = None,
    risk: str | Risk | None = None,
    *,
    request: Given = None,
    output: str | Path | None = None,
    resume: bool = False,
    threads: Workers = None,
    progress: Progress | None = None,
    **settings: Any,
) -> Design:
    """Find the candidates that no other beats in all objectives at once, within limits, on grounds that are not known.

    Parameters
    ----------
    scene
        Or the name of a device, or a scene file; left out, that which the request names.
    free
        Paths of the scene that may change, each with its range (low, high) or None for the usual one of a gait;
        ``gait.phases`` with a `Symmetry` that ties the phases of all legs; ``signals.DRIVE`` with `Pulses`.
    objective
        One to three measures with a direction, ``most mean_speed``, ``least hardest_impact.tip``, or words of
        `tarsus.design.measures.OBJECTIVES`; with commas or as a list.
    limits
        Measures that every run keeps, ``{"slip_ratio": ("<", 0.2)}`` or ``"mean_speed > 2 mm/s"``; that of the model
        is always among them.
    over
        Grounds: a mapping of paths to (low, high), `Grounds`, or a file of draws of `tarsus identify`. All candidates
        are judged on the same ones.
    risk
        Of each objective for itself, over the grounds: worst, mean, nominal, or `tarsus.design.cvar`; worst with
        grounds, else nominal.
    request
        Settings as a mapping or a TOML file, see `settings_text`; what is given as an argument prevails.
    output
        Folder for what is found and its page, and of finished runs, from which a design that was killed goes on with
        `resume`; in Python of runs alone, ``write`` adds the rest.
    threads
        Worker threads, or an executor.
    progress
        Called as ``progress(done, total, what)``.
    settings
        Further ones: candidates, look, seed; starts and duration of a settled motion, which objectives are of, the mean
        of several starts on the scene's own ground; or from_rest [s], of an episode of that length; or periods, of the
        last of so many drive periods.

    Returns
    -------
    Design
        One list of candidates, all judged alike: the front under the risk (`members`), of which the first is the robust
        one, and the nominal optimum; the active grounds and the certificate.

    Raises
    ------
    InputError
        With every problem of the request.
    """
    options = settings_of(
        DesignSettings, request, free=free, objective=objective, limits=limits, over=over, risk=risk, **settings
    )
    scene = options.scene if scene is None else scene
    if scene is None:
        raise InputError("scene: name a device or a scene file, or a request that does")
    asked = problem_of(as_scene(scene), options, options.risk)
    return found_for(asked, options, output, progress, threads=threads, resume=resume)


def found_for(
    asked: DesignProblem,
    options: DesignSettings,
    folder: str | Path | None = None,
    progress: Progress | None = None,
    *,
    threads: Workers = None,
    resume: bool = False,
) -> Design:
    """What the search of a problem finds; runs are kept in a folder, if any."""
    texts = {**scene_texts(asked.scene), "request.txt": asked.text}
    store = RunStore.open(folder, texts, resume=resume, what="design", values=asked.numbers)
    return DesignSearch(replace(asked, threads=threads), options, store, progress).design()
