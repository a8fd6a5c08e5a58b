"""What the dissertation says of its simulations of walking (section 4.4.1, Figs. 4.7-4.11), as claims on measures.

It prints no numbers, only trends in words, over ground parameters (Table 4.2) and payload. Captions say *maximum*
displacement and *maximum* contact duration: quantities of the whole run, of body and legs alike. A count in a
simulation has no vibrometer's resolution: every rebound counts.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from enum import Enum

from tarsus.files.rows import parse_rows
from tarsus.measure.walking import OF_EPISODES
from tarsus.model.scene import Scene
from tarsus_reproduce.packaged import data_text
from tarsus_reproduce.trends import MUCH_ABOVE, SAID, SIGNS


class FilmUnit(Enum):
    """The two interpretations of the film coefficient's unit in Table 4.2 (erratum E4). The value is the unit."""

    NANO = "nN m^2 s"
    MICRO = "uN m^2 s"

    @property
    def unit(self) -> float:
        """The unit in N m^2 s."""
        return 1e-9 if self is FilmUnit.NANO else 1e-6

    @classmethod
    def of(cls, scene: Scene) -> FilmUnit:
        """The unit that a device takes: Table 2.2 prints 1.747e-15, so its coefficient lies a thousand times lower in
        nN than in uN; the limit is the geometric mean of both."""
        film = scene.ground.film
        limit = 1.747e-15 * (cls.NANO.unit * cls.MICRO.unit) ** 0.5
        return cls.NANO if film is not None and film.coefficient < limit else cls.MICRO


@dataclass(frozen=True)
class Trend:
    """One thing that is said of a figure: of which quantity, over which packaged study, and what.

    claim: what is said (`tarsus_reproduce.trends.SAID`), from `beyond` on where that is a number; measures: the one
    that the figure shows, then others that the words could mean; film: the unit's interpretation, where the figure has
    one for each; scored: False of a cause that is stated (E15).
    """

    figure: str
    study: str
    quantity: str
    claim: str
    beyond: float | None
    measures: tuple[str, ...]
    film: FilmUnit | None
    scored: bool

    @property
    def says(self) -> str:
        """What is said of the quantity: 'falls'."""
        return SAID[self.claim]

    @property
    def directional(self) -> bool:
        """Whether it says a direction, which noise rarely shows; white noise has local extrema nearly always."""
        return self.claim in SIGNS or self.claim.removeprefix("much above ") in MUCH_ABOVE


TRENDS_FILE = "trends_4_4_1.csv"
TRENDS = tuple(
    Trend(
        row["figure"],
        row["study"],
        row["quantity"],
        row["says"],
        float(row["beyond"]) if row["beyond"] else None,
        tuple(row["measures"].split()),
        FilmUnit(row["film"]) if row["film"] else None,
        row["scored"] != "no",
    )
    for row in parse_rows(data_text(TRENDS_FILE), TRENDS_FILE).rows
)
"""Trends of section 4.4.1 in its order: that of Fig. 4.9 once for each unit, that of Fig. 4.7 with its causes."""

GROUNDS = "grounds"
"""The study of Fig. 4.7: C_e and C_adh of ground (a), then of (b)."""
FROM_REST = "_from_rest"
"""End of the name of a measure by drive period that is taken over the run from rest."""


def of_episode(measure: str) -> bool:
    """Whether a measure is one of a whole run from rest, not of the settled motion."""
    return measure in OF_EPISODES or measure.endswith(FROM_REST)


def scored_trends(film: FilmUnit) -> list[Trend]:
    """The 16 trends that a device is scored by: of Fig. 4.9 the one in its own unit."""
    return [trend for trend in TRENDS if trend.scored and trend.film in (None, film)]


DIRECTIONAL = sum(trend.directional and trend.scored for trend in TRENDS)
"""Directional trends."""


def examples(film: FilmUnit) -> Mapping[str, dict[str, float]]:
    """Grounds of Fig. 4.7 in SI by name: C_e read as nN m^2/V^2, C_sfd as `film`, C_adh as N/s."""
    common = {"ground.film.coefficient": 1e-18 * film.unit, "ground.restitution.coefficient": 0.7}
    return {
        "a": {"ground.electrostatic.coefficient": 1e-17, "ground.adhesion.rate": 1e-8, **common},
        "b": {"ground.electrostatic.coefficient": 1e-21, "ground.adhesion.rate": 1e-2, **common},
    }
