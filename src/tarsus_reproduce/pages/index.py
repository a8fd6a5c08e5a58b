"""The index of all pages: what was calibrated, what is predicted, what cannot be matched, with a link to each page."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from tarsus.files.library import load_scene
from tarsus.files.version import package_version
from tarsus.files.whole import write_text
from tarsus.model.scene import Source
from tarsus.report.html import Cell, Column, Markup, escape, page, table

__all__ = ["EXPERIMENTS", "Experiment", "index_html", "write_index"]

Result = Mapping[str, Any]


@dataclass(frozen=True)
class Experiment:
    """One page: its folder, what it compares, the device, and what cannot be matched whatever the device."""

    folder: str
    kind: str
    device: str | None
    title: str
    unmatched: tuple[str, ...]


_CANTILEVER = (
    "Table A.1 reports contact at 5 Hz and 6 V but none at 15 Hz and 6 V, both square and both slow against the "
    "beam's 623 Hz: a tip that settles within milliseconds reaches the ground in both or in neither.",
    "The printed branches of the drive's hysteresis do not meet at ±6 V (E5), so the 6 V rows rest on a closed "
    "operator fitted to them.",
    "Counts of bounces depend on the height and the contact that an instrument can tell; the dissertation states "
    "neither.",
)

EXPERIMENTS = (
    Experiment(
        "cantilever", "cantilever", "cantilever", "Micro-cantilever against its measurement (Table A.1)", _CANTILEVER
    ),
    Experiment(
        "cantilever-1", "cantilever", "cantilever-1", "Micro-cantilever against the dissertation's model (Table A.1)",
        (
            "This device is fitted to the model column: it says how far that model is reproduced, and nothing of the "
            "measurement.",
            *_CANTILEVER[1:],
        ),
    ),
    Experiment(
        "hexapod", "robot", "hexapod", "Bouncing foot of the hexapod (Table 3.2)",
        (
            "Gains, drive frequencies, polarity and the counting rule of Table 3.2 are not printed: two rows fix a "
            "device only up to these, and several devices fit them alike.",
            "All counts of the table are multiples of 20 in a second, which one window of 50 ms gives: a count is "
            "known to 10 % at best.",
            "'Avg. height' is not defined: the mean over time and the mean of the highest points are both shown.",
            "The printed matrices and the printed frequencies differ by up to 31 % (E10); the printed impact matrix "
            "can create energy, so a passive one acts.",
        ),
    ),
    Experiment(
        "quadruped", "robot", "quadruped", "Modes and impact maps of the quadruped (chapter 3)",
        (
            "The dissertation prints no table of heights for it: nothing is compared with a measurement.",
            "Its printed mass matrix is not positive (E9) and its stiffness not symmetric (E8): the device is rebuilt "
            "from frequencies, damping and shapes.",
        ),
    ),
    Experiment(
        "millipede", "millipede", None, "Trends of the walking millipede (section 4.4.1)",
        (
            "Masses, stiffness, damping, gains and frequency of the walking model are not printed, so no device is the "
            "dissertation's: named readings and their distribution stand in its place.",
            "Contact that falls beyond 0.2 mg, and an amplitude with a local maximum and minimum that nevertheless "
            "falls, are hardly shown by any reading.",
            "Fig. 4.7 is said to follow from electrostatic attraction, which by Fig. 4.8 lowers the amplitude (E15).",
            "The damping of Table 4.1 leaves no oscillation, which the text and Fig. 4.4 have (E16).",
        ),
    ),
)  # fmt: skip
"""All pages, in the order of the chapters."""


def write_index(results: Mapping[str, Result], path: str | Path) -> Path:
    """Write the index as one self-contained HTML file and return its path.

    `results` has what `tarsus reproduce EXPERIMENT --json` prints for each folder of `EXPERIMENTS`. Raises InputError
    if `path` cannot be written.
    """
    target = Path(path)
    write_text(target, index_html(results))
    return target


def index_html(results: Mapping[str, Result]) -> str:
    """The page as text; see `write_index`."""
    columns = [
        Column("page", number=False),
        *(Column(title, number=False) for title in ("calibrated", "predicted")),
    ]
    chosen = [one for one in EXPERIMENTS if one.folder in results]
    rows: list[list[Cell]] = []
    for one in chosen:
        link = Markup(f'<a href="{one.folder}/reproduction.html">{escape(one.title)}</a>')
        rows.append([link, _calibrated(one, results[one.folder]), _predicted(one, results[one.folder])])
    parts = [
        "<h1>The dissertation, reproduced</h1>\n",
        '<p class="lede">“Foot Impact and Dynamic Analyses of Piezoelectrically-Actuated Walking Micro-Robots”, '
        f"chapters 2 to 4, computed anew with Tarsus {escape(package_version())}.</p>\n",
        table(columns, rows, wrap=True),
        "<h2>How to read the pages</h2>\n",
        _LEGEND,
        "<h2>What cannot be matched, and what these devices miss</h2>\n",
    ]
    for one in chosen:
        said = "".join(
            f"<li>{escape(text)}</li>\n" for text in (*one.unmatched, *_missed(one, results[one.folder]))
        )
        parts.append(f"<h3>{escape(one.title)}</h3>\n<ul>\n{said}</ul>\n")
    parts.append(
        f"<footer><p>Made by Tarsus {escape(package_version())} with <code>tarsus reproduce --all</code>. E1 to E16 "
        "are entries of the errata in its documentation.</p></footer>"
    )
    return page("The dissertation, reproduced", "".join(parts))


_LEGEND = """<ul>
<li><b>Calibrated on</b>: the device's unknown numbers were fitted to this row. Its error says how well the model can
be bent to the data, and nothing of what it knows.</li>
<li><b>Predicted</b>: nothing was fitted to this row. Only these errors speak for the model.</li>
<li>A prediction is the <b>median</b>, with the <b>interval that holds 80 %</b>: of drive periods after transients for
the cantilever, of windows of 50 ms over random initial states for the robots, and of all devices that fit where there
are several. Errors are (measured − median) / measured.</li>
<li>A <b>bounce</b> is a flight that clears 0.1 µm after a contact shorter than 0.5 ms, or a tenth of the drive period,
however it began. The share of periods or windows with one stands beside the count.</li>
<li>A trend <b>agrees</b>, <b>contradicts</b>, is <b>insensitive</b> (nothing changes, which tells of the device) or
<b>not determined</b> (the replicates differ).</li>
</ul>
"""


def _calibrated(one: Experiment, result: Result) -> str:
    if one.kind == "millipede":
        return "nothing: the devices are readings of the text"
    assert one.device is not None
    origins = load_scene(one.device).provenance
    numbers = [path for path, origin in origins.items() if origin.source is Source.CALIBRATED]
    assumed = sum(origin.source is Source.ASSUMED for origin in origins.values())
    fitted = sum(row["role"] == "calibrated on" for row in result["rows"])
    if not fitted:
        return f"on no row; {assumed} values are assumed"
    said = f"{len(numbers)} values on {fitted} of {len(result['rows'])} rows; {assumed} further values are assumed"
    return f"{said}; errors there on average: {_fit(one, result)}"


def _fit(one: Experiment, result: Result) -> str:
    """Mean absolute errors of the medians on the rows that were calibrated on."""
    if one.kind == "robot":
        errors = result["summary_calibrated"]["ours"]
        named = {"bounces": "bounces_per_s", "peak": "peak_um", "mean height": "mean_um"}
        return ", ".join(
            f"{words} {errors[key]:.0f} %" for words, key in named.items() if errors[key] is not None
        )
    whole = result["summary"].get("calibrated_rows", result["summary"])
    table = whole["ours_against_source" if one.device == "cantilever-1" else "ours"]
    peak, contact = (table[key]["mean_absolute_percent"] for key in ("peak", "contact"))
    return (
        f"peak {peak:.1f} %, contact {contact:.1f} %; existence of bounces right in {table['existence_right']} of "
        f"{table['count_cases']}"
    )


def _predicted(one: Experiment, result: Result) -> str:
    if one.kind == "millipede":
        scores = [
            f"{name}: {found['agree']} of 16 agree, {found['contradict']} contradict, {found['directional_agree']} of "
            f"{found['directional_total']} directional agree"
            for name, found in result["variants"].items()
        ]
        if "readings" in result and "agree" in result["readings"]:
            drawn = result["readings"]
            scores.append(
                f"random readings ({drawn['judged']}): {drawn['agree']['mean']:.1f} agree on average, 95 % at most "
                f"{drawn['agree']['quantile_95']:.0f}"
            )
        return "; ".join(scores)
    rows = [row for row in result["rows"] if row["role"] == "predicted"]
    measured = sum(bool(row["measured"]) for row in rows)
    if not result["rows"]:
        return "modes, impact maps and motion in the air, for which no numbers are printed"
    if not rows:
        return "no row: give rows that were not fitted with --rows"
    return f"{len(rows)} row{'s' * (len(rows) != 1)}, {measured} of them measured"


def _missed(one: Experiment, result: Result) -> Sequence[str]:
    """Measured values far from the prediction: outside its interval, and more than 30 % off."""
    if one.kind == "millipede":
        return ()
    against = "source" if one.device == "cantilever-1" else "measured"
    out = []
    for row in result["rows"]:
        far = []
        for name, found in row["ours"].items():
            value = (row[against] or {}).get(name)
            if value is None or found["median"] is None or found["low"] <= value <= found["high"]:
                continue
            if abs(value - found["median"]) > 0.3 * abs(value):
                quantity, _, unit = name.replace("_per_s", " a second").partition("_")
                far.append(f"{quantity} {value:g} against {found['median']:.3g} {unit}".rstrip())
        if far:
            drive = f"{row['volt_v']:g} V {row['wave']}, {row['freq_hz']:.4g} Hz"
            out.append(f"Row {drive} ({row['role']}): {'; '.join(far)}.")
    return out
