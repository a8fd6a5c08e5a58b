"""Ground, gait and start of walkers: the printed reference ground, and what has to be assumed with it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from tarsus.model.laws import Adhesion, Electrostatic, Film, Friction, Gravity, Restitution
from tarsus.model.laws.friction import AnyFriction
from tarsus.model.laws.landing import AnyLanding
from tarsus.model.scene import Ground, Provenance, Source

__all__ = ["Setting", "assumed", "printed"]


def assumed(note: str) -> Provenance:
    """Provenance of a value that the source does not give."""
    return Provenance(source=Source.ASSUMED, note=note)


def printed(note: str) -> Provenance:
    """Provenance of a value that the source prints."""
    return Provenance(source=Source.PRINTED, note=note)


@dataclass(frozen=True)
class Setting:
    """What a walker walks on, and how it starts.

    friction, landing: laws, each with its provenance by path in `laws`; film_thickness [m] at contact; offset [m] of
    the electrostatic law; frequency [Hz] of the gait, with why; standing: started in equilibrium on its feet, not
    with springs relaxed.
    """

    friction: AnyFriction
    landing: AnyLanding | None = None
    film_thickness: float = 0.2e-6
    offset: float = 20e-6
    frequency: float = 50.0
    frequency_note: str = "Not printed. One of the drive frequencies of section 2.5."
    standing: bool = True
    laws: Mapping[str, Provenance] = field(default_factory=dict)

    @property
    def ground(self) -> Ground:
        """The reference ground that section 4.4.1 starts from: Table 2.2, and Table 3.3's electrostatics."""
        return Ground(
            restitution=Restitution(coefficient=0.378),
            landing=self.landing,
            adhesion=Adhesion(initial=0.2743e-6, rate=1.7e-6),
            film=Film(coefficient=1.747e-24, thickness=self.film_thickness),
            electrostatic=Electrostatic(coefficient=1e-18, offset=self.offset),
            gravity=Gravity(),
            friction=self.friction,
        )

    @property
    def origins(self) -> dict[str, Provenance]:
        """Where every number of the ground comes from, by path."""
        start = "Table 2.2, from which section 4.4.1 starts"
        return {
            "ground.restitution.coefficient": printed(f"{start}; Table 4.2 tries 0.1 to 0.9."),
            "ground.adhesion.initial": printed(f"C_a0 of {start}."),
            "ground.adhesion.rate": printed(f"C_a of {start}; Table 4.2 tries 1e-8 to 0.1 N/s."),
            "ground.film.coefficient": printed(
                f"C_s of {start}, in nN m^2 s as printed, there and in Table 4.2; uN m^2 s is the other reading (E4)."
            ),
            "ground.film.thickness": assumed(
                "Not printed for a foot. With the 58 um of Table 2.2 the film would do nothing and Fig. 4.9 could not "
                "exist; the roughness of a wafer and its dust."
            ),
            "ground.electrostatic.coefficient": Provenance(
                source=Source.DERIVED,
                note="C_e of Table 3.3, 1e-9 without a unit, read in nN m^2/V^2 like the range of Table 4.2.",
            ),
            "ground.electrostatic.offset": assumed(
                "Not printed. A foot's electrode is a film on the leg, not its tip; a tenth of the shin."
            ),
            "ground.gravity.acceleration": assumed(
                "Standard gravity; (4.5) leaves it out, but its payloads weigh."
            ),
            **self.laws,
        }


COULOMB = Setting(
    Friction(coefficient=0.4),
    laws={
        "ground.friction.coefficient": assumed(
            "Not printed: the source's friction is arbitrary. A round number for dry hard surfaces."
        )
    },
)
"""Walkers that are no reading of chapter 4's figures: landing by the default rule, friction by a round number."""
