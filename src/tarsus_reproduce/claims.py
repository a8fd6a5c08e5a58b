"""What the dissertation says of its simulations of walking (section 4.4.1, Figs. 4.7-4.11), as claims on measures.

It prints no numbers, only trends in words, over ground parameters (Table 4.2) and payload. Captions say *maximum*
displacement and *maximum* contact duration: quantities of the whole run, of body and legs alike. A count in a
simulation has no vibrometer's resolution: every rebound counts.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from enum import Enum

from tarsus.model.scene import Scene
from tarsus_reproduce.trends import Claim, Direction, HasExtrema, HasMaximum, falls, rises

PAYLOAD_KNEE = 0.2e-6
"""Body mass beyond which contact gets shorter (section 4.4.1, Fig. 4.11) [kg]; the only one the text names."""

ELECTROSTATICS, ADHESION, PAYLOAD = "millipede-electrostatics", "millipede-adhesion", "millipede-payload"


class FilmUnit(Enum):
    """The two interpretations of the film coefficient's unit in Table 4.2 (erratum E4). The value is the unit."""

    NANO = "nN m^2 s"
    MICRO = "uN m^2 s"

    @property
    def unit(self) -> float:
        """The unit in N m^2 s."""
        return 1e-9 if self is FilmUnit.NANO else 1e-6

    @property
    def study(self) -> str:
        """The packaged study of Fig. 4.9 in this unit."""
        return f"millipede-film-{self.name.lower()}"

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

    measures: the one that the figure shows, then others that the words could mean; film: the unit's interpretation,
    where the figure has one for each.
    """

    figure: str
    study: str
    quantity: str
    claim: Claim
    measures: tuple[str, ...]
    film: FilmUnit | None = None

    @property
    def says(self) -> str:
        """What is said of the quantity: 'falls'."""
        return self.claim.words

    @property
    def directional(self) -> bool:
        """Whether it says a direction, which noise rarely shows; white noise has local extrema nearly always."""
        return isinstance(self.claim, Direction)


_HEAVE = ("max_heave", "vertical_amplitude")
_LEGS = ("max_peak", "peak")
_TRAVEL = ("max_surge", "stride")
_BOUNCES = ("total_rebounds_any_height", "total_bounces", "impacts")
_CONTACT = ("longest_contact", "contact_duration")

TRENDS = (
    Trend("4.8", ELECTROSTATICS, "vertical amplitude of the body", falls(), _HEAVE),
    Trend("4.8", ELECTROSTATICS, "vertical amplitude of the legs", falls(), _LEGS),
    Trend("4.8", ELECTROSTATICS, "travel", falls(), _TRAVEL),
    Trend("4.8", ELECTROSTATICS, "number of bounces", rises(), _BOUNCES),
    Trend("4.8", ELECTROSTATICS, "contact", rises(), _CONTACT),
    Trend("4.8", ELECTROSTATICS, "vertical amplitude of the body", HasExtrema(), _HEAVE),
    Trend("4.8", ELECTROSTATICS, "number of bounces", HasExtrema(), _BOUNCES),
    Trend("4.8", ELECTROSTATICS, "contact", HasExtrema(), _CONTACT),
    *(
        Trend("4.9", one.study, f"travel, film in {one.value}", HasMaximum(), _TRAVEL, one)
        for one in FilmUnit
    ),
    Trend("4.10", ADHESION, "travel", HasMaximum(), _TRAVEL),
    Trend("4.10", ADHESION, "number of bounces", falls(), _BOUNCES),
    Trend("4.11", PAYLOAD, "vertical amplitude of the body", falls(), _HEAVE),
    Trend("4.11", PAYLOAD, "travel", falls(), _TRAVEL),
    Trend("4.11", PAYLOAD, "number of bounces", rises(), _BOUNCES),
    Trend("4.11", PAYLOAD, "contact beyond 0.2 mg", falls(beyond=PAYLOAD_KNEE), _CONTACT),
)
"""Trends of section 4.4.1, in its order; that of Fig. 4.9 once for each unit."""

EXAMPLE_CLAIM = "the body oscillates much more on ground (a) than on (b)"
"""What is said of Fig. 4.7; it counts as a directional trend."""


def scored_trends(film: FilmUnit) -> list[Trend]:
    """The 15 trends that a device is scored by: of Fig. 4.9 the one in its own unit."""
    return [trend for trend in TRENDS if trend.film in (None, film)]


DIRECTIONAL = 1 + sum(trend.directional for trend in TRENDS)
"""Directional trends, Fig. 4.7 included."""


def examples(film: FilmUnit) -> Mapping[str, dict[str, float]]:
    """Grounds of Fig. 4.7 in SI by name: C_e read as nN m^2/V^2, C_sfd as `film`, C_adh as N/s."""
    common = {"ground.film.coefficient": 1e-18 * film.unit, "ground.restitution.coefficient": 0.7}
    return {
        "a": {"ground.electrostatic.coefficient": 1e-17, "ground.adhesion.rate": 1e-8, **common},
        "b": {"ground.electrostatic.coefficient": 1e-21, "ground.adhesion.rate": 1e-2, **common},
    }
