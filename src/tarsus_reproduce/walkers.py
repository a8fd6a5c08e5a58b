"""Walking robots built from the parameters of the millipede: three masses, thirty legs, six legs for a tripod."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from tarsus.base.errors import InputError
from tarsus.base.messages import nearest
from tarsus.files.library import load_scene
from tarsus.model.drive.gait import Alternating, AnyGait, Tripod
from tarsus.model.drive.laws import LinearForce
from tarsus.model.robot import Drive, Foot, PointLoad, Robot
from tarsus.model.scene import Initial, Provenance, Scene, Source, Standing
from tarsus.model.structure import Walker, WalkerBody, WalkerLeg
from tarsus_reproduce.legs import millipede_leg
from tarsus_reproduce.millipede_parameters import LEGS, Derived, MillipedeParameters, millipede_parameters
from tarsus_reproduce.millipede_variants import millipede_variants
from tarsus_reproduce.walker_settings import COULOMB, Setting, assumed

__all__ = ["hexapod_walker", "many_legs", "millipede", "packaged_walkers"]

PITCH, WIDTH = 10e-3 / 15, 2e-3
"""Assumed: way from leg to leg along a side, so that 15 pairs make a body of 10 mm, and width of the body [m]."""

DEPTH = 250e-6
"""Feet below the body: the length of the shin, Table 4.1 [m]."""

CAPACITANCE = 2 * 8.8541878128e-12 * 1000.0 * (250e-6 * 100e-6) / 1e-6
"""Assumed: two actuators a leg, each a PZT film of the thigh's length, 100 um wide and 1 um thick, of relative
permittivity 1000 [F]."""

DURATION = 0.2
"""Assumed: of a run [s]."""


def millipede(
    parameters: MillipedeParameters, legs: int = 2, *, setting: Setting = COULOMB, name: str = "millipede"
) -> Scene:
    """The source's three masses (4.4)-(4.6), walking: a body that surges and heaves on two legs that alternate.

    Parameters
    ----------
    parameters
        Of the body's share and one leg, see `tarsus_reproduce.millipede_parameters.millipede_parameters`.
    legs
        Even number of legs; beyond two, the body has the share of every pair, and the legs move as in the gait.
    setting
        Ground, frequency of the gait, and start.
    name
        Of the scene.

    Raises
    ------
    InputError
        For a number of legs that is not even and positive.
    """
    places = _rows(legs)
    gait = _gait(Alternating, parameters, setting)
    return _Builder(parameters, places, turns=False, setting=setting).scene(name, gait)


def many_legs(
    parameters: MillipedeParameters,
    legs: int = LEGS,
    *,
    scatter: float = 0.0,
    dead: Sequence[str] = (),
    seed: int = 0,
    gait: AnyGait | None = None,
) -> Scene:
    """The whole millipede: legs ``L1, R1, L2 ...`` from the front in two rows under a slab that also rolls and pitches.

    Parameters
    ----------
    parameters
        As in `millipede`.
    legs
        Even number of legs.
    scatter
        Spread of the legs' stiffness: standard deviation of its logarithm, upward and along the way apart.
    dead
        Legs without a drive, by name; they stand, and keep their place in the gait.
    seed
        Of the scattered stiffness.
    gait
        Pattern; alternating when absent.

    Raises
    ------
    InputError
        For a number of legs that is not even and positive, unknown dead legs and a negative spread.
    """
    places = _rows(legs)
    problems = [f"dead: there is no leg '{leg}'{nearest(leg, places)}" for leg in dead if leg not in places]
    if not scatter >= 0.0:
        problems.append(f"scatter: expected a spread of 0 or more, got {scatter:g}")
    if problems:
        raise InputError(problems)
    builder = _Builder(parameters, places, turns=True, setting=COULOMB, scatter=scatter, dead=dead, seed=seed)
    return builder.scene(f"millipede-{legs}", gait or _gait(Alternating, parameters, COULOMB))


def hexapod_walker(parameters: MillipedeParameters) -> Scene:
    """Six legs of the millipede under a slab that also rolls and pitches, walking in tripods."""
    builder = _Builder(parameters, _rows(6), turns=True, setting=COULOMB)
    return builder.scene("hexapod-walker", _gait(Tripod, parameters, COULOMB))


def packaged_walkers() -> dict[str, Scene]:
    """The packaged walkers by name, from the packaged leg; their files are what `tarsus.write_scene` makes of these."""
    parameters = millipede_parameters(millipede_leg().leg)
    named = {
        name: millipede(one.parameters, setting=one.setting, name=name)
        for name, one in millipede_variants(parameters).items()
    }
    return {**named, "millipede-30": many_legs(parameters, scatter=0.1, seed=1)}


def _rows(legs: int) -> dict[str, tuple[float, float]]:
    """Hips (x, y) [m] of legs in two rows, from the front, the left one of a pair first."""
    if legs < 2 or legs % 2:
        raise InputError(f"legs: expected an even number of legs, 2 or more, got {legs}")
    pairs = legs // 2
    ahead = [(0.5 * (pairs - 1) - pair) * PITCH for pair in range(pairs)]
    sides = (("L", 0.5 * WIDTH), ("R", -0.5 * WIDTH))
    return {f"{side}{pair + 1}": (x, y) for pair, x in enumerate(ahead) for side, y in sides}


def _gait(
    kind: type[Alternating] | type[Tripod], parameters: MillipedeParameters, setting: Setting
) -> AnyGait:
    return kind(frequency=setting.frequency, high=parameters.volts.value)


def _tidy(value: float) -> float:
    """Six digits, so that a file reads well; no parameter is known better."""
    return float(f"{value:.6g}")


@dataclass(frozen=True)
class _Builder:
    """A scene from parameters and hips (x, y), with the provenance of every number; turns: it rolls and pitches."""

    parameters: MillipedeParameters
    hips: Mapping[str, tuple[float, float]]
    turns: bool
    setting: Setting
    scatter: float = 0.0
    dead: Sequence[str] = ()
    seed: int = 0

    @property
    def pairs(self) -> int:
        return len(self.hips) // 2

    @property
    def length(self) -> float:
        """Length of the body [m]; a body that does not turn stands for one of the prototype's, or a longer one."""
        return (self.pairs if self.turns else max(self.pairs, LEGS // 2)) * PITCH

    @property
    def driven(self) -> list[str]:
        return [leg for leg in self.hips if leg not in self.dead]

    def scene(self, name: str, gait: AnyGait) -> Scene:
        return Scene(
            name=name,
            robot=Robot(structure=self._walker(), drives=self._drives(), feet=self._feet()),
            ground=self.setting.ground,
            gait=gait,
            initial=Initial(standing=Standing() if self.setting.standing else None),
            duration=DURATION,
            provenance={
                **self._origins(),
                **self.setting.origins,
                **_gait_origins(gait, self.parameters, self.setting),
            },
            citations=tuple(
                one.replace("chapter 2 and appendix A", "chapter 4")
                for one in load_scene("cantilever").citations
            ),
        )

    def _walker(self) -> Walker:
        p = self.parameters
        mass = self.pairs * p.body_mass.value
        body = WalkerBody(
            mass=_tidy(mass),
            length=_tidy(self.length),
            roll_inertia=_tidy(mass * WIDTH**2 / 12.0) if self.turns else None,
            pitch_inertia=_tidy(mass * self.length**2 / 12.0) if self.turns else None,
        )
        factors = np.random.default_rng(self.seed).lognormal(0.0, self.scatter, (len(self.hips), 2))
        legs = {
            leg: WalkerLeg(
                x=_tidy(x),
                y=y,
                z=-DEPTH if self.turns else 0.0,
                mass=_tidy(p.leg_mass.value),
                stiffness_v=_tidy(p.stiffness_v.value * upward),
                damping_v=_tidy(p.damping_v.value),
                stiffness_l=_tidy(p.stiffness_l.value * along),
                damping_l=_tidy(p.damping_l.value),
            )
            for (leg, (x, y)), (upward, along) in zip(self.hips.items(), factors.tolist(), strict=True)
        }
        return Walker(body=body, legs=legs)

    def _drives(self) -> dict[str, Drive]:
        p = self.parameters
        along = _tidy(p.gain_l.value / p.gain_v.value)
        law = LinearForce(gain=_tidy(p.gain_v.value))
        return {
            leg: Drive(
                load=PointLoad(
                    weights={leg: -1.0, f"{leg}_hip": 1.0, f"{leg}_x": -along, f"{leg}_hip_x": along}
                ),
                law=law,
                capacitance=_tidy(CAPACITANCE),
            )
            for leg in self.driven
        }

    def _feet(self) -> dict[str, Foot]:
        gap = self.parameters.foot_gap.value
        return {
            leg: Foot(point=leg, gap=gap, electrode=leg if leg in self.driven else None) for leg in self.hips
        }

    def _origins(self) -> dict[str, Provenance]:
        p = self.parameters
        legs, drives = "robot.structure.legs.*", "robot.drives.*"
        slab = "A slab of the body's mass, as long as its rows of legs and 2 mm wide, of no height."
        turning = {f"robot.structure.body.{one}_inertia": assumed(slab) for one in ("roll", "pitch")}
        return {
            "duration": assumed("Ten periods of a gait of 50 Hz, twenty of one of 100 Hz."),
            "robot.structure.body.mass": self._body_mass(),
            "robot.structure.body.length": assumed(
                slab if self.turns else "Not printed. A prototype of 10 mm."
            ),
            **(turning if self.turns else {}),
            f"{legs}.x": assumed("Not printed. Legs at equal distances, 15 of them on 10 mm."),
            f"{legs}.y": assumed("Not printed. A body of 2 mm from row to row."),
            f"{legs}.z": self._depth(),
            f"{legs}.mass": p.leg_mass.origin,
            f"{legs}.stiffness_v": self._scattered(p.stiffness_v),
            f"{legs}.damping_v": p.damping_v.origin,
            f"{legs}.stiffness_l": self._scattered(p.stiffness_l),
            f"{legs}.damping_l": p.damping_l.origin,
            f"{drives}.load.weights": assumed(
                "Equal and opposite on hip and foot; volts push the foot down and back. Along the way, the lateral "
                f"actuator's force for each newton upward, both at the same voltage. {p.gain_l.origin.note}"
            ),
            f"{drives}.law.gain": p.gain_v.origin,
            f"{drives}.law.offset": assumed("Springs are relaxed at 0 V."),
            f"{drives}.capacitance": assumed(
                "Not printed. Two actuators a leg, electrically coupled, each a PZT film of the thigh's 250 um by "
                "100 um, 1 um thick, of relative permittivity 1000."
            ),
            "robot.feet.*.gap": p.foot_gap.origin,
        }

    def _body_mass(self) -> Provenance:
        origin = self.parameters.body_mass.origin
        if self.pairs == 1:
            return origin
        bounds = origin.interval or ()
        return Provenance(
            source=origin.source,
            note=f"{self.pairs} times the share of two legs. {origin.note}",
            interval=tuple((self.pairs * low, self.pairs * high) for low, high in bounds) or None,
        )

    def _depth(self) -> Provenance:
        if not self.turns:
            return assumed("The body does not pitch, so that it does not matter.")
        note = "The feet are the length of the shin, L_S of Table 4.1, below the body: forces along the way act there."
        return Provenance(source=Source.DERIVED, note=note)

    def _scattered(self, one: Derived) -> Provenance:
        if self.scatter == 0.0:
            return one.origin
        spread = f"Scattered at random (lognormal, seed {self.seed}) by {self.scatter * 100:g} %"
        return assumed(f"{spread} about {one.value:.4g} {one.unit}. {one.origin.note}")


def _gait_origins(gait: AnyGait, parameters: MillipedeParameters, setting: Setting) -> dict[str, Provenance]:
    given = {
        "gait.frequency": assumed(setting.frequency_note),
        "gait.low": assumed("On-off input: nothing between steps."),
        "gait.high": parameters.volts.origin,
        "gait.duty": assumed("Both groups of legs alike."),
        "gait.swing_lag": assumed("Without effect: vertical and lateral actuators are electrically coupled."),
    }
    named = {"gait.phases": assumed("Chosen with the gait.")} if gait.kind == "free" else {}
    return {**given, **named}
