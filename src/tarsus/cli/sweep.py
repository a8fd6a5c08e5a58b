"""`tarsus sweep`: many runs of one scene, scored, into a store that survives being killed."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from cyclopts import Parameter


def sweep(
    study: str,
    /,
    *,
    output: Annotated[Path | None, Parameter(name=["--output", "-o"])] = None,
    threads: int | None = None,
    resume: Annotated[bool, Parameter(negative=())] = False,
    overwrite: Annotated[bool, Parameter(negative=())] = False,
    law: Annotated[list[Path] | None, Parameter(negative=())] = None,
) -> int:
    """Run a study: a scene over many values of its floats, every run scored.

    Parameters
    ----------
    study
        a packaged study or a study file (TOML).
    output
        folder for the study, its finished parts and sweep.nc; by default the study's name with .sweep.
    threads
        worker threads; by default one for each processor that this process may use. The result does not depend on them.
    resume
        continue what the folder holds; finished parts are not run again.
    overwrite
        begin again: replace what `sweep` wrote into the folder before; other files stay.
    law
        a Python file with laws that the scene uses; may be repeated.
    """
    import shlex
    import time

    from tarsus.base.errors import InputError
    from tarsus.cli import console, requests
    from tarsus.files.output import OutputFolder
    from tarsus.files.sweepstore import SWEEP_FILES
    from tarsus.study.studyfile import load_sweep
    from tarsus.study.sweeping import run_sweep
    from tarsus.study.workunit import OUTCOMES

    the_sweep = load_sweep(study, requests.laws_of(law or ()))
    folder = output if output is not None else Path(f"{Path(study).stem}.sweep")
    if resume and overwrite:
        raise InputError("--resume continues a sweep and --overwrite begins it again: give one of them")
    target = OutputFolder(folder, "sweep", SWEEP_FILES, overwrite, resumable=True)
    target.check(resume=resume)
    start = time.perf_counter()
    try:
        with target.writing(resume=resume), console.progress_bar("runs", time_left=True) as progress:
            result = run_sweep(
                the_sweep,
                folder,
                resume=resume,
                threads=threads,
                progress=lambda done, total: progress(done, total, ""),
            )
    except KeyboardInterrupt:
        words = [
            "tarsus",
            "sweep",
            study,
            "-o",
            str(folder),
            *(w for f in law or () for w in ("--law", str(f))),
        ]
        console.complain(
            [f"interrupted; finished parts are kept, continue with `{shlex.join(words)} --resume`"]
        )
        return 1
    seconds = time.perf_counter() - start
    earlier = f", {result.kept} of them done before" if result.kept else ""
    print(f"{the_sweep.name}: {result.runs} runs of {the_sweep.seconds:g} s in {seconds:.1f} s{earlier}")
    for name, count in result.outcomes.items():
        print(f"  {count:>8}  {OUTCOMES[name]}")
    print(f"wrote {result.file}")
    return 0 if "DONE" in result.outcomes else 1
