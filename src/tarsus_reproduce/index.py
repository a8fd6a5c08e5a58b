"""The index of all pages: what was calibrated, what is predicted, what cannot be matched, with a link to each page."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from tarsus.files.library import load_scene
from tarsus.model.scene import Source
from tarsus.report.pages import Markup, Section, bullets, sections_page
from tarsus.tables import Table
from tarsus_reproduce.compared import MINE, SOURCE_COLUMN
from tarsus_reproduce.reproduction import CALIBRATED, NOTABLE, PREDICTED
from tarsus_reproduce.rows import CANTILEVER, HEIGHTS, PrintedQuantity
from tarsus_reproduce.verb import Experiment, experiments

Result = Mapping[str, Any]


def index_html(results: Mapping[str, Result]) -> str:
    """The index of all pages: what was calibrated, what is predicted, what cannot be matched, with a link to each page.

    `results` has the plain data of a `Reproduction` by name of `tarsus_reproduce.verb.experiments`.
    """
    chosen = [(one, results[name]) for name, one in experiments().items() if name in results]
    link = Markup('<a href="{}/reproduction.html">{}</a>')
    rows = [
        (link.format(one.name, one.title), _calibrated(one, result), _predicted(one, result)) for one, result in chosen
    ]
    missed = [Section(one.title, bullets([*one.unmatched, *_missed(one, result)])) for one, result in chosen]
    about = (
        "“Foot Impact and Dynamic Analyses of Piezoelectrically-Actuated Walking Micro-Robots”, chapters 2 to 4, "
        "computed anew with Tarsus."
    )
    sections = [
        Section("How to read the pages", READING),
        Section("What cannot be matched, and what these devices miss", *missed),
    ]
    footer = Markup(
        "All of them: <code>tarsus reproduce --all</code>. E1 to E16 are entries of the errata in its documentation."
    )
    pages = Table("", ("page", "calibrated", "predicted"), rows)
    return sections_page("The dissertation, reproduced", [about, pages], sections, footer)


READING = Markup("""<ul>
<li><b>Calibrated on</b>: the device's unknown numbers were fitted to this row. Its error says how well the model can be
bent to the data, and nothing of what it knows.</li>
<li><b>Predicted</b>: nothing was fitted to this row. Only these errors speak for the model.</li>
<li>A prediction is the <b>median</b>, with the <b>interval that holds 80 %</b>: of drive periods after transients for
the cantilever, of windows of 50 ms over random initial states for the robots, and of all devices that fit where there
are several. Errors are (measured − median) / measured.</li>
<li>A <b>bounce</b> is a flight that clears 0.1 µm after a contact shorter than 0.5 ms, or a tenth of the drive period,
however it began. The share of periods or windows with one is given with the count.</li>
<li>A trend <b>agrees</b>, <b>contradicts</b>, is <b>insensitive</b> (nothing changes, which is about the device) or
<b>not determined</b> (the replicates differ).</li>
</ul>""")


def _calibrated(one: Experiment, result: Result) -> str:
    if one.experiment == "millipede":
        return "nothing: the devices are interpretations of the text"
    origins = load_scene(one.device or one.experiment).provenance
    numbers = [path for path, origin in origins.items() if origin.source is Source.CALIBRATED]
    assumed = sum(origin.source is Source.ASSUMED for origin in origins.values())
    fitted = sum(row["role"] == CALIBRATED for row in result["rows"])
    if not fitted:
        return f"on no row; {assumed} values are assumed"
    said = f"{len(numbers)} values on {fitted} of {len(result['rows'])} rows; {assumed} further values are assumed"
    summary, table = result["summary"], HEIGHTS if one.experiment != "cantilever" else CANTILEVER
    merits = summary.get(CALIBRATED, summary["all rows"])[SOURCE_COLUMN if one.against == "source" else MINE]
    errors = ", ".join(_error(each, found) for each in table.quantities if (found := merits[each.key])["in_means"])
    return f"{said}; errors there on average: {errors}"


def _error(quantity: PrintedQuantity, found: Mapping[str, Any]) -> str:
    """Mean size of the error of a quantity, and the skill."""
    error, skill = found["mean_absolute_error"], found["skill"]
    size = f"{error:.2g} off" if quantity.count else f"{100.0 * error:.1f} %"
    return f"{quantity.words} {size}" + ("" if skill is None else f" (skill {skill:.2f})")


def _predicted(one: Experiment, result: Result) -> str:
    if one.experiment == "millipede":
        scores = [
            f"{name}: {found['agree']} of 16 agree, {found['contradict']} contradict, {found['directional_agree']} of "
            f"{found['directional_total']} directional agree"
            for name, found in result["variants"].items()
        ]
        drawn = result.get("readings", {})
        if "agree" in drawn:
            mean, most = drawn["agree"]["mean"], drawn["agree"]["quantile_95"]
            scores.append(
                f"random interpretations ({drawn['judged']}): {mean:.1f} agree on average, 95 % at most {most:.0f}"
            )
        return "; ".join(scores)
    rows = [row for row in result["rows"] if row["role"] == PREDICTED]
    measured = sum(bool(row["measured"]) for row in rows)
    if not result["rows"]:
        return "modes, impact laws and motion in the air, for which no numbers are printed"
    if not rows:
        return "no row: give rows that were not fitted with --rows"
    return f"{len(rows)} row{'s' * (len(rows) != 1)}, {measured} of them measured"


def _missed(one: Experiment, result: Result) -> list[str]:
    """Printed values far from the prediction: outside its interval, and more than `NOTABLE` off."""
    out = []
    for row in result.get("rows", ()):
        far = []
        for name, found in row["ours"].items():
            value = (row[one.against] or {}).get(name)
            if value is None or found["median"] is None or found["low"] <= value <= found["high"]:
                continue
            if abs(value - found["median"]) > NOTABLE * abs(value):
                quantity, _, unit = name.replace("_per_s", " a second").partition("_")
                far.append(f"{quantity} {value:g} against {found['median']:.3g} {unit}".rstrip())
        if far:
            drive = f"{row['volt_v']:g} V {row['wave']}, {row['freq_hz']:.4g} Hz"
            out.append(f"Row {drive} ({row['role']}): {'; '.join(far)}.")
    return out
