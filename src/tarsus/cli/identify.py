"""`tarsus identify`: from a campaign of records to a device with intervals, and a report."""

from __future__ import annotations

from math import isfinite
from pathlib import Path
from typing import TYPE_CHECKING

from tarsus.cli.options import PAGES, MaybeFolder, Pages, Seed

if TYPE_CHECKING:
    from tarsus.identify.chain import Identification


def identify(
    campaign: Path,
    /,
    *,
    output: MaybeFolder = None,
    seed: Seed = 1,
    pages: Pages = PAGES,
) -> int:
    """Identify a device from a campaign of records: structure, drive, film, adhesion, restitution, with intervals.

    Parameters
    ----------
    campaign
        campaign.toml, or the folder it is in (see `tarsus synthesize` for one).
    output
        folder for identified.toml, identification.json, draws.npz and report.html; by default "identified" beside the
        campaign file.
    """
    from tarsus.cli import console
    from tarsus.identify.campaign import read_campaign
    from tarsus.identify.chain import identify as run
    from tarsus.identify.result import RESULT_FILES, summary_of, write_identification

    opened = read_campaign(campaign)
    folder = output if output is not None else opened.folder / "identified"
    target = pages.target(folder, "identify", RESULT_FILES)
    with console.progress_bar("steps") as progress:
        found = run(opened, seed, progress)
    with target.writing():
        written = write_identification(found, folder)
        if pages.report:
            from tarsus.report.identify_page import write_identify_report

            written.append(write_identify_report(found, folder / "report.html"))
    console.note(found.remarks)
    console.note(f"excluded: {one}" for one in found.left_out)
    console.complain([f"{one.name} was not done: {said}" for one in found.not_done for said in one.reasons])
    if pages.json:
        console.print_json(summary_of(found))
    else:
        _show(found)
        print(f"\n{found.seconds:.0f} s")
        console.wrote(written)
    return 1 if found.not_done else 0


def _show(found: Identification) -> None:
    from tarsus.base.spec import float_paths
    from tarsus.cli import console
    from tarsus.identify.assessment import assessed
    from tarsus.identify.result import TAKEN
    from tarsus.identify.verdict import Determined

    units = float_paths(found.model.scene)
    judged = assessed(found)
    rows = []
    for step in found.steps.values():
        for path, value in zip(step.paths, step.values, strict=True):
            unit = units[path].unit
            word = "" if judged is None or path not in judged.names else judged[path].word
            word = TAKEN if path in step.taken else word
            rows.append((path, *(_shown(float(v), unit) for v in (value, *step.interval(path))), word))
        for name, (value, draws, unit) in step.combinations.items():
            low, high = _middle(draws)
            rows.append((name, *(_shown(v, unit) for v in (value, low, high)), ""))
    console.table(("parameter", "value", "from", "to (95 %)", "verdict"), rows)
    for one in () if judged is None else judged.verdicts:
        if not isinstance(one, Determined):
            print(one.sentence(units[one.name].unit))
    print("\n" + "; ".join(_landing(found)))
    used = found.files_used
    print(f"\n{used} of {len(found.readings)} files used")
    for step in found.steps.values():
        left = f"; {step.unused} left out" if step.left_out else ""
        print(f"  {step.name}: {'; '.join(str(one) for one in step.used)}{left}")
    if found.comparisons:
        peak, contact = (_size(found, which) for which in ("peak", "contact"))
        print(
            f"held-out signals: {len(found.comparisons)}; absolute error of peaks {peak}, of contact durations "
            f"{contact}"
        )


def _landing(found: Identification) -> list[str]:
    """What is known of the landing rule."""
    if found.landing is not None:
        return found.landing.sentences()
    return [f"landing rule: {found.model.scene.ground.landing_rule.kind} is assumed, no records decide it"]


def _size(found: Identification, which: str) -> str:
    """Median and mean of the absolute errors of the held-out records that show any."""
    import numpy as np

    errors = 100.0 * np.abs([one.error(which) for one in found.comparisons])
    known = errors[np.isfinite(errors)]
    return f"{np.median(known):.2g} % (mean {known.mean():.2g} %)" if len(known) else "unknown"


def _shown(value: float, unit: str) -> str:
    """Five digits with the SI unit."""
    if not isfinite(value):
        return "-"
    return f"{value:.5g}" if unit == "1" else f"{value:.5g} {unit}"


def _middle(draws: object) -> tuple[float, float]:
    import numpy as np

    low, high = np.quantile(np.asarray(draws), [0.025, 0.975])
    return float(low), float(high)
