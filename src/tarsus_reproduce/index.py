"""The index of all pages: what each compares, with a link to it, and what cannot be matched."""

from __future__ import annotations

from collections.abc import Mapping

from tarsus.report.pages import Markup, Section, bullets, sections_page
from tarsus.tables import Table
from tarsus_reproduce.verb import experiments


def index_html(about: Mapping[str, str]) -> str:
    """The page over those of experiments (`tarsus_reproduce.verb.experiments`), by name, with what each is about."""
    chosen = [one for name, one in experiments().items() if name in about]
    link = Markup('<a href="{}/reproduction.html">{}</a>')
    pages = Table("", ("page", "of"), [(link.format(one.name, one.title), about[one.name]) for one in chosen])
    words = (
        "“Foot Impact and Dynamic Analyses of Piezoelectrically-Actuated Walking Micro-Robots”, chapters 2 to 4, "
        "computed anew with Tarsus."
    )
    sections = [
        Section("How to read the pages", READING),
        Section("What cannot be matched", *(Section(one.title, bullets(one.unmatched)) for one in chosen)),
    ]
    footer = Markup(
        "All of them: <code>tarsus reproduce --all</code>. E1 to E16 are entries of the errata in its documentation."
    )
    return sections_page("The dissertation, reproduced", [words, pages], sections, footer)


READING = Markup("""<ul>
<li><b>Calibrated on</b>: the device's unknown numbers were fitted to this row. Its error says how well the model can be
bent to the data, and nothing of what it knows.</li>
<li><b>Predicted</b>: nothing was fitted to this row. Only these errors speak for the model.</li>
<li>A prediction is the <b>median</b>, with the <b>interval that holds 80 %</b>: of drive periods after transients for
the cantilever, of windows of 50 ms over random initial states for the robots, and of all devices that fit where there
are several. Errors are (measured − median) / measured; those beyond 30 % are coloured.</li>
<li>A <b>bounce</b> is a flight that clears 0.1 µm after a contact shorter than 0.5 ms, or a tenth of the drive period,
however it began. The share of periods or windows with one is given with the count.</li>
<li>A trend <b>agrees</b>, <b>contradicts</b>, is <b>insensitive</b> (nothing changes, which is about the device) or
<b>not determined</b> (the replicates differ).</li>
</ul>""")
