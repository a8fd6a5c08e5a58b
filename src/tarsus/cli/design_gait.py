"""`tarsus design gait` and `tarsus design adapt`: gaits for grounds that nobody measured."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, Any

from cyclopts import Parameter

from tarsus.cli.options import (
    HERE,
    PAGES,
    UNCHANGED,
    Changes,
    Count,
    Duration,
    Folder,
    Grounds,
    Pages,
    Resume,
    Risk,
    Seed,
    Work,
)

if TYPE_CHECKING:
    from tarsus.design.adaptive import AdaptiveGait
    from tarsus.design.gait_fronts import GaitFront


@Parameter(name="*")
@dataclass(frozen=True, kw_only=True)
class Gaits:
    """Which gaits are tried, and how they are walked."""

    symmetry: Annotated[
        str,
        Parameter(
            help="of the phases: none, mirror (legs across half a period apart), pairs (legs across together) or wave."
        ),
    ] = "none"
    dead: Annotated[str, Parameter(help="legs that do not move, with commas.")] = ""
    candidates: Annotated[Count, Parameter(help="gaits that are tried in all.")] = 4000
    duration: Duration = None
    seed: Seed = 0

    def read(self, **further: tuple[str, str]) -> dict[str, Any]:
        """As the designs take them, with further quantities, each its words and its unit."""
        from tarsus.cli import requests

        legs = tuple(leg.strip() for leg in self.dead.split(",") if leg.strip())
        plain = {"symmetry": self.symmetry, "dead": legs, "candidates": self.candidates}
        return requests.quantities_of(duration=(self.duration, "s"), **further) | plain


GAITS = Gaits()

Free = Annotated[
    list[str],
    Parameter(
        negative=(),
        help="what may change: gait.frequency, gait.duty, gait.high=7V:14V, or gait.phases for the phases of all legs; "
        "with commas, or repeated.",
    ),
]


def gait(
    scene: str,
    /,
    *,
    free: Free,
    output: Folder,
    objective: str = "speed,energy",
    over: Grounds = None,
    risk: Risk = None,
    look: Count = 48,
    loss: str = "10 %",
    gaits: Gaits = GAITS,
    changes: Changes = UNCHANGED,
    work: Work = HERE,
    resume: Resume = False,
    pages: Pages = PAGES,
) -> int:
    """Find the gaits that no other beats in speed, energy, slip or contact, on grounds that nobody measured.

    Parameters
    ----------
    scene
        a walker: a device (see `tarsus devices`) or a scene file.
    output
        folder for gaits.json, front.csv, gait.h (the robust gait), report.html, and the scene and the page of every
        gait of the front.
    objective
        one to three of speed, energy, transport, slip, contact, support and sway, with commas.
    look
        grounds that an attack on the front looks at before it climbs.
    loss
        what the robust gait may lose on the scene's own ground.
    """
    from tarsus.cli import console, requests
    from tarsus.design.gait_files import FRONT_FILES, gait_table, write_front
    from tarsus.design.gait_fronts import gait as design
    from tarsus.design.gait_request import GaitOptions, gait_request
    from tarsus.design.kept import KEPT_FILES

    options: dict[str, Any] = gaits.read(loss=(loss, "1")) | {"look": look}
    the_free, grounds = requests.spans_of(free, "--free", bare=True), requests.grounds_of(over or ())
    the_scene = changes.scene(scene)
    target = pages.target(output, "design gait", (*FRONT_FILES, *KEPT_FILES), resume=resume)
    gait_request(
        the_scene, the_free, objective, grounds, risk, GaitOptions(**options)
    )  # before a file is touched
    with (
        console.resumable(),
        target.writing(resume=resume) as folder,
        console.progress_bar("gaits") as progress,
        work.workers() as workers,
    ):
        found = design(
            the_scene, the_free, objective, grounds, risk, folder=folder, resume=resume,
            progress=progress, seed=gaits.seed, threads=workers, **options,
        )  # fmt: skip
        write_front(found, folder)
        if pages.report:
            from tarsus.report.gait_page import write_gait_report

            write_gait_report(found, folder)
    if pages.json:
        console.print_json(gait_table(found))
    else:
        _show(found)
        console.wrote([folder])
    return 0


def adapt(
    scene: str,
    /,
    *,
    free: Free,
    over: Grounds,
    output: Folder,
    sense: str = "charge",
    objective: str = "speed",
    steps: Count = 20,
    most: Annotated[Count, Parameter(name="--gaits")] = 10,
    hidden: Count = 200,
    training: Count = 256,
    noise: str = "2 %",
    repeats: Count = 1,
    gaits: Gaits = GAITS,
    changes: Changes = UNCHANGED,
    work: Work = HERE,
    pages: Pages = PAGES,
) -> int:
    """Find a few gaits, and the table that chooses among them by what the robot senses in its first steps.

    Parameters
    ----------
    scene
        a walker: a device (see `tarsus devices`) or a scene file.
    output
        folder for adapt.json, hidden.csv and report.html.
    sense
        charge, slip, both with a comma, or nothing.
    objective
        one of speed, transport, slip, contact, support and sway.
    steps
        walked with up to four of the gaits, the probes, before one is chosen.
    most
        how many gaits at most.
    hidden
        hidden grounds that the choice is judged on.
    training
        grounds that the table is of.
    noise
        standard deviation of what is sensed, as a share of it.
    repeats
        walks, a thousandth apart, that every gait is judged by on every ground: more than one where walks ring.
    """
    from tarsus.cli import console, requests
    from tarsus.design.adaptive import adapt as design
    from tarsus.design.gait_files import ADAPT_FILES, adapt_table, write_adapt

    options = gaits.read(noise=(noise, "1"))
    the_free, grounds = requests.spans_of(free, "--free", bare=True), requests.grounds_of(over or ())
    the_scene = changes.scene(scene)
    target = pages.target(output, "design adapt", ADAPT_FILES)
    with console.progress_bar("adaptive gait") as progress, work.workers() as workers:
        found = design(
            the_scene, the_free, grounds, sense, objective, steps=steps, gaits=most, hidden=hidden, training=training,
            repeats=repeats, progress=progress, seed=gaits.seed, threads=workers, **options,
        )  # fmt: skip
    with target.writing() as folder:
        write_adapt(found, folder)
        if pages.report:
            from tarsus.report.gait_page import write_adapt_report

            write_adapt_report(found, folder / "report.html")
    if pages.json:
        console.print_json(adapt_table(found))
    else:
        _show_adapted(found)
        console.wrote([folder])
    return 0


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
    print(f"all numbers are of walks of {design.request.duration:g} s from one start, not of settled motion")
    if judged and design.gap == design.gap:
        print(f"gap of the worst grounds: {100 * design.gap:.2g} %; {len(design.grounds)} grounds active")
    if design.certificate is not None:
        looked = design.certificate
        print(
            f"of {looked.grounds} grounds drawn by chance at the end {looked.worse} were more than 2 % worse for any "
            f"gait shown than known; at most {100 * looked.share:.2g} % of the box are (95 %)"
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
        print(f"gait {number}{' (probe)' if number in design.probes else ''}: {told}")
    low, high = design.regret_interval
    print(
        f"\nlost on {len(design.known)} hidden grounds: {100 * design.regret:.2g} % ({100 * low:.2g} to "
        f"{100 * high:.2g} %); the best single gait loses {100 * design.fixed_regret:.2g} %, the best of these each "
        f"time {100 * design.choice_regret:.2g} %"
    )
