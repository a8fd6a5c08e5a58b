"""The ground: which laws act between it and the feet."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from pydantic import Field, ValidationError, ValidationInfo, create_model, field_validator, model_validator

from tarsus.base.messages import PathErrors, located_faults, nearest
from tarsus.base.spec import Description, FrozenDict, MaybeAmount, Named, quantity
from tarsus.model.laws import (
    Adhesion,
    AnyFriction,
    AnyImpactMap,
    AnyLanding,
    CaptureUnlessPulled,
    Electrostatic,
    Film,
    Gravity,
    Law,
    LegElectrostatic,
    Restitution,
)
from tarsus.model.laws.registry import built_in, slots
from tarsus.model.motion import GroundMotion
from tarsus.model.profile import AnyProfile

__all__ = ["Ground"]


class _Ground(Description):
    """What of a ground is no law's slot, and what acts; see `Ground`."""

    if TYPE_CHECKING:  # the slots, as type checkers see them; what they are says `tarsus.model.laws.registry`
        restitution: Restitution | None = None
        landing: AnyLanding | None = None
        adhesion: Adhesion | None = None
        film: Film | None = None
        electrostatic: Electrostatic | None = None
        leg_electrostatic: LegElectrostatic | None = None
        gravity: Gravity | None = None
        friction: AnyFriction | None = None

    impact: AnyImpactMap | None = Field(
        default=None, description="how the whole structure follows an impact; absent: mass-weighted"
    )
    near_field_forces: bool = Field(
        default=True, description="false leaves the film and the electrostatic laws out of the simulation"
    )
    incline: MaybeAmount = quantity(
        "rad",
        "angle by which the ground rises in the direction +x along it: 90 deg is a wall, 180 deg a ceiling; "
        "absent: level",
        default=None,
        ge=-math.pi,
        le=math.pi,
    )
    profile: AnyProfile | None = Field(
        default=None, description="uneven ground under a walker: its height along the way; absent: level"
    )
    motion: GroundMotion | None = Field(default=None, description="how the ground moves; absent: it stays")
    laws: Named[Law] = Field(default=FrozenDict(), description="further laws by name, a user's own among them")

    @property
    def falling(self) -> tuple[float, float]:
        """Acceleration of gravity [m/s^2], 0 without, and the incline [rad] of the ground, 0 for a level one."""
        return (0.0 if self.gravity is None else self.gravity.acceleration), self.incline or 0.0

    @property
    def acting(self) -> Ground:
        """The ground as it acts: without film and electrostatics where `near_field_forces` is off."""
        if self.near_field_forces:
            return self
        small = {slot: None for slot, law in self._in_slots().items() if law.small}
        return self.model_copy(update={**small, "near_field_forces": True})

    @property
    def acting_laws(self) -> Mapping[str, Law]:
        """What acts on the feet, by name: the laws in slots, then those of `laws`.

        Of `laws`, one that says how a foot rebounds or what a contact holds takes the place of the one in the slot.
        """
        own = dict(self.laws)
        ruled = {law.hook for law in own.values()} - {"momentum", "force"}
        here = {slot: law for slot, law in self.acting._in_slots().items() if law.hook not in ruled}
        return {name: law for name, law in {**here, **own}.items() if law.hook is not None}

    def acting_on(self, hook: str) -> dict[str, Law]:
        """Those of `acting_laws` that the engine calls in one place; see `tarsus.model.laws.Law.hook`."""
        return {name: law for name, law in self.acting_laws.items() if law.hook == hook}

    def by_path(self) -> dict[str, Law]:
        """Every law of the ground, acting or not, by its path in it."""
        return {**self._in_slots(), **{f"laws.{name}": law for name, law in self.laws.items()}}

    def _in_slots(self) -> dict[str, Law]:
        return {slot: law for slot in slots() if (law := getattr(self, slot)) is not None}

    @property
    def holds(self) -> bool:
        """Whether a contact has a strength: adhesion or an adhesive hold among `laws` acts."""
        return bool(self.acting_on("strength"))

    @property
    def without_adhesion(self) -> Ground:
        """The ground without the law of adhesion in its slot, and without friction that only adhesion bears."""
        bare = self.model_copy(update={slot: None for slot, law in self._in_slots().items() if law.hook == "strength"})
        if not bare.holds:
            alone = {slot: None for slot, law in bare._in_slots().items() if law.needs_strength}
            bare = bare.model_copy(update=alone)
        return bare

    @property
    def landing_rule(self) -> AnyLanding:
        """The landing rule that acts, given or not."""
        return CaptureUnlessPulled() if self.landing is None else self.landing

    @property
    def makes_energy(self) -> bool:
        """Whether impacts may create kinetic energy: an impact law acts as it is."""
        return self.impact is not None and not self.impact.passive

    @model_validator(mode="after")
    def _named_apart(self) -> _Ground:
        """Names of laws are those of their forces and works in series and accounts: each means one thing."""
        taken = {*self._in_slots(), "drive", "contact", "friction", "ground"}
        faults = [
            (f"laws.{name}", f"the name '{name}' is taken by another force on the feet: give the law another")
            for name, law in self.laws.items()
            if name in taken and law.hook in ("momentum", "force")
        ]
        for hook in ("rebound", "strength", "friction", "excess"):
            several = [name for name, law in self.laws.items() if law.hook == hook]
            if len(several) > 1:
                text = f"only one law can say {_RULED[hook]}, got {', '.join(several)}"
                faults.append(("laws", text))
        if self.incline is not None and self.gravity is None:
            faults.append(("incline", "turns gravity, which there is none of: give ground.gravity"))
        if faults:
            raise PathErrors(faults)
        return self

    @field_validator("laws", mode="before")
    @classmethod
    def _user_laws(cls, value: Any, info: ValidationInfo) -> Any:
        """Tables of laws: of the library, and of a user by the classes in the validation context."""
        if not isinstance(value, Mapping):
            return value
        given: Mapping[str, type[Law]] = (info.context or {}).get("laws", {})
        known = {name: law for name, law in built_in().items() if law.hook is not None} | dict(given)
        laws: dict[str, Any] = {}
        faults: list[tuple[str, str]] = []
        for name, item in value.items():
            if not isinstance(item, Mapping):
                laws[name] = item
                continue
            kind = str(item.get("kind", name))
            law = known.get(kind)
            if law is None:
                hint = nearest(kind, known) if given else "; give the file that defines it (--law FILE.py)"
                faults.append((str(name), f"no law of kind '{kind}' is known{hint}"))
                continue
            try:
                laws[name] = law.model_validate({k: v for k, v in item.items() if k != "kind"})
            except ValidationError as error:
                faults += [(f"{name}.{path}", text) for path, text in located_faults(law, error)]
        if faults:
            raise PathErrors(faults)
        return laws


_RULED = {
    "rebound": "how fast a foot departs",
    "strength": "what a contact holds",
    "friction": "what friction bears",
    "excess": "when a foot that lands is held",
}
"""What is said by one law at a time, by hook."""

if TYPE_CHECKING:
    Ground = _Ground
else:
    Ground = create_model(
        "Ground",
        __base__=_Ground,
        __module__=__name__,
        __doc__="""The set of laws between feet and ground; an absent law does not act.

    Without restitution an impact takes all of the approach speed.
    """,
        **{name: (slot.type | None, Field(default=None, description=slot.note)) for name, slot in slots().items()},
    )
