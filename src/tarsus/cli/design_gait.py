"""`tarsus design gait` and `tarsus design adapt`: gaits for grounds that nobody measured."""

from __future__ import annotations

import shlex
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from cyclopts import Parameter

if TYPE_CHECKING:
    from tarsus.design.adaptive import AdaptiveGait
    from tarsus.design.gait_fronts import GaitFront


def gait(
    scene: str,
    /,
    *,
    free: Annotated[list[str], Parameter(negative=())],
    output: Annotated[Path, Parameter(name=["--output", "-o"])],
    objective: str = "speed,energy",
    over: Annotated[list[str] | None, Parameter(negative=())] = None,
    risk: str | None = None,
    symmetry: str = "none",
    dead: str = "",
    candidates: int = 4000,
    look: int = 48,
    loss: str = "10 %",
    duration: str | None = None,
    seed: int = 0,
    threads: int | None = None,
    dask: str | None = None,
    set_: Annotated[list[str] | None, Parameter(name="--set", negative=())] = None,
    law: Annotated[list[Path] | None, Parameter(negative=())] = None,
    resume: Annotated[bool, Parameter(negative=())] = False,
    overwrite: Annotated[bool, Parameter(negative=())] = False,
    report: bool = True,
    json: Annotated[bool, Parameter(negative=())] = False,
) -> int:
    """Find the gaits that no other beats in speed, energy, slip or contact, on grounds that nobody measured.

    Parameters
    ----------
    scene
        a walker: a device (see `tarsus devices`) or a scene file.
    free
        what may change: gait.frequency, gait.duty, gait.high=7V:14V, or gait.phases for the phases of all legs; with
        commas, or repeated.
    output
        folder for gaits.json, front.csv, gait.h (the robust gait), report.html, and the scene and the page of every
        gait of the front.
    objective
        one to three of speed, energy, transport, slip, contact, support and sway, with commas.
    over
        PATH=a:b, a number that is not known, from a to b; may be repeated. Or a draws.npz of `tarsus identify`.
    risk
        worst, cvar:q, mean or nominal; worst with --over, else nominal.
    symmetry
        of the phases: none, mirror (legs across half a period apart), pairs (legs across together) or wave.
    dead
        legs that do not move, with commas.
    candidates
        gaits that are tried in all.
    look
        grounds that an attack on the front looks at before it climbs.
    loss
        what the robust gait may lose on the scene's own ground.
    duration
        of a walk; the scene's own when left out.
    seed
        of the search.
    threads
        worker threads; by default one for each processor that this process may use.
    dask
        make the runs on the workers of a Dask cluster: address of its scheduler, its scheduler file, or `local`.
    set_
        path=value, changes the scene first; may be repeated.
    law
        a Python file with laws that the scene uses; may be repeated.
    resume
        continue what the folder holds; walks that are there are not walked again.
    overwrite
        begin again: replace what `design gait` wrote into the folder before; other files stay.
    report
        write report.html and the pages of the gaits.
    json
        print one JSON object instead of the table.
    """
    from tarsus.base.errors import InputError
    from tarsus.cli import console, requests
    from tarsus.design.gait_files import FRONT_FILES, gait_table, write_front
    from tarsus.design.gait_fronts import gait as design
    from tarsus.design.kept import KEPT_FILES
    from tarsus.files.output import OutputFolder

    if resume and overwrite:
        raise InputError("--resume continues a design and --overwrite begins it again: give one of them")
    options: dict[str, Any] = requests.quantities_of(loss=(loss, "1"), duration=(duration, "s"))
    given = {"free": _free(free), "over": requests.grounds_of(over or ())}
    the_scene = requests.scene_for(scene, requests.settings(set_ or ()), law or ())
    target = OutputFolder(output, "design gait", (*FRONT_FILES, *KEPT_FILES), overwrite, resumable=True)
    target.check(resume=resume)
    legs = tuple(leg.strip() for leg in dead.split(",") if leg.strip())
    _checked(
        the_scene,
        given,
        objective,
        risk,
        options | {"symmetry": symmetry, "dead": legs, "candidates": candidates, "look": look},
    )
    try:
        with (
            target.writing(resume=resume) as folder,
            console.progress_bar("gaits") as progress,
            requests.workers_for(dask, threads) as workers,
        ):
            found = design(
                the_scene, given["free"], objective, given["over"], risk, folder=folder, resume=resume,
                progress=progress, symmetry=symmetry, dead=legs, candidates=candidates, look=look, seed=seed,
                threads=workers, **options,
            )  # fmt: skip
            write_front(found, folder)
            if report:
                from tarsus.report.gait_page import write_gait_report

                write_gait_report(found, folder)
    except KeyboardInterrupt:
        from tarsus.cli.app import INTERRUPTED

        console.complain(
            [
                f"interrupted; the walks so far are kept in {shlex.quote(str(output))}: the same line with "
                "--resume goes on"
            ]
        )
        return INTERRUPTED
    if json:
        console.print_json(gait_table(found))
    else:
        _show(found)
        print(f"wrote {folder}")
    return 0


def adapt(
    scene: str,
    /,
    *,
    free: Annotated[list[str], Parameter(negative=())],
    over: Annotated[list[str], Parameter(negative=())],
    output: Annotated[Path, Parameter(name=["--output", "-o"])],
    sense: str = "charge",
    objective: str = "speed",
    steps: int = 20,
    gaits: int = 6,
    hidden: int = 200,
    training: int = 96,
    noise: str = "2 %",
    repeats: int = 1,
    symmetry: str = "none",
    dead: str = "",
    candidates: int = 4000,
    duration: str | None = None,
    seed: int = 0,
    threads: int | None = None,
    dask: str | None = None,
    set_: Annotated[list[str] | None, Parameter(name="--set", negative=())] = None,
    law: Annotated[list[Path] | None, Parameter(negative=())] = None,
    overwrite: Annotated[bool, Parameter(negative=())] = False,
    report: bool = True,
    json: Annotated[bool, Parameter(negative=())] = False,
) -> int:
    """Find a few gaits, and the rule that chooses among them by what the robot senses in its first steps.

    Parameters
    ----------
    scene
        a walker: a device (see `tarsus devices`) or a scene file.
    free
        as for `tarsus design gait`.
    over
        PATH=a:b, a number that the robot does not know, from a to b; may be repeated. Or a draws.npz of `tarsus
        identify`.
    output
        folder for adapt.json, hidden.csv and report.html.
    sense
        charge, slip, both with a comma, or nothing.
    objective
        one of speed, transport, slip, contact, support and sway.
    steps
        walked with the first gait before the rule chooses.
    gaits
        how many at most.
    hidden
        hidden grounds that the rule is judged on.
    training
        grounds that the rule is grown on.
    noise
        standard deviation of what is sensed, as a share of it.
    repeats
        walks, a thousandth apart, that every gait is judged by on every ground: more than one where walks ring.
    symmetry, dead, candidates, duration, seed, threads, dask
        as for `tarsus design gait`.
    set_
        path=value, changes the scene first; may be repeated.
    law
        a Python file with laws that the scene uses; may be repeated.
    overwrite
        replace what `design adapt` wrote into the folder before; other files stay.
    report
        write report.html.
    json
        print one JSON object instead of the table.
    """
    from tarsus.cli import console, requests
    from tarsus.design.adaptive import adapt as design
    from tarsus.design.gait_files import ADAPT_FILES, adapt_table, write_adapt
    from tarsus.files.output import OutputFolder

    options: dict[str, Any] = requests.quantities_of(noise=(noise, "1"), duration=(duration, "s"))
    the_free, grounds = _free(free), requests.grounds_of(over)
    the_scene = requests.scene_for(scene, requests.settings(set_ or ()), law or ())
    target = OutputFolder(output, "design adapt", ADAPT_FILES, overwrite)
    target.check()
    with console.progress_bar("adaptive gait") as progress, requests.workers_for(dask, threads) as workers:
        found = design(
            the_scene, the_free, grounds, sense, objective, steps=steps, gaits=gaits, hidden=hidden, training=training,
            repeats=repeats, progress=progress, symmetry=symmetry,
            dead=tuple(leg.strip() for leg in dead.split(",") if leg.strip()),
            candidates=candidates, seed=seed, threads=workers, **options,
        )  # fmt: skip
    with target.writing() as folder:
        write_adapt(found, folder)
        if report:
            from tarsus.report.gait_page import write_adapt_report

            write_adapt_report(found, folder / "report.html")
    if json:
        console.print_json(adapt_table(found))
    else:
        _show_adapted(found)
        print(f"wrote {folder}")
    return 0


def _free(words: list[str]) -> dict[str, tuple[str, str] | None]:
    """``PATH`` and ``PATH=a:b`` words as paths with their ranges."""
    from tarsus.base.errors import InputError

    problems: list[str] = []
    found: dict[str, tuple[str, str] | None] = {}
    for word in (part.strip() for one in words for part in one.split(",")):
        path, equals, span = (one.strip() for one in word.partition("="))
        low, colon, high = (one.strip() for one in span.partition(":"))
        if not path or (equals and not (low and colon and high)):
            problems.append(f"--free takes PATH or PATH=a:b, such as gait.duty=0.2:0.8, got '{word}'")
        elif path in found:
            problems.append(f"--free names '{path}' twice")
        else:
            found[path] = (low, high) if equals else None
    if problems:
        raise InputError(problems)
    return found


def _checked(
    scene: Any, given: dict[str, Any], objective: str, risk: str | None, options: dict[str, Any]
) -> None:
    """Raise InputError for a bad request before anything is written."""
    from tarsus.design.gait_request import GaitOptions, gait_request

    gait_request(scene, given["free"], objective, given["over"], risk, GaitOptions(**options))


def _show(design: GaitFront) -> None:
    from tarsus.cli import console
    from tarsus.design.gait_files import gait_scene_names

    judged = design.request.over is not None
    head = ["gait"]
    for one in design.objectives:
        unit = "" if one.unit == "1" else f" ({one.unit})"
        head += [f"{one.name}{unit}", *(["worst"] if judged and one.grounded else [])]
    names = list(design.request.unknowns.paths)[:4]
    rows = []
    for name, point in gait_scene_names(design):
        row = [name]
        for j, one in enumerate(design.objectives):
            row += [
                f"{point.nominal[j]:.4g}",
                *([f"{point.worst[j]:.4g}"] if judged and one.grounded else []),
            ]
        rows.append((*row, *(f"{point.values[path]:.4g}" for path in names)))
    console.table((*head, *(path.removeprefix("gait.") for path in names)), rows)
    print(
        f"\n{design.candidates} gaits tried, {design.runs} walks"
        + (f", {design.reused} read" if design.reused else "")
    )
    if judged and design.gap == design.gap:
        print(f"gap of the worst grounds: {100 * design.gap:.2g} %; {len(design.grounds)} grounds active")
    if design.certificate is not None:
        looked = design.certificate
        print(
            f"of {looked.grounds} grounds drawn by chance at the end {looked.worse} were more than 2 % worse than "
            f"known; at most {100 * looked.share:.2g} % of the box are (95 %)"
        )
    if judged:
        print(f"worst {design.objectives[0].name}, robust gait over nominal optimum: {design.gain:.3g}")


def _show_adapted(design: AdaptiveGait) -> None:
    from tarsus.cli import console

    console.table(("when", "gait"), [(said, str(number)) for said, number in design.table])
    for number, values in enumerate(design.gaits):
        told = ", ".join(
            f"{path.removeprefix('gait.')} {value:.4g}" for path, value in list(values.items())[:6]
        )
        print(f"gait {number}{' (probe)' if number == design.probe else ''}: {told}")
    print(
        f"\nlost on {len(design.known)} hidden grounds: {100 * design.regret:.2g} %; the best single gait loses "
        f"{100 * design.fixed_regret:.2g} %, the best of these each time {100 * design.choice_regret:.2g} %"
    )
