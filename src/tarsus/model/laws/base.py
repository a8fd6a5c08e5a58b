"""Protocols of ground laws: what happens between a foot and the ground.

A law is a frozen description (its parameters, with units and bounds) and one plain function of floats.
The parameters reach the function by position, in the order of the fields.  Five protocols are open to everybody:

* `DampingLaw`: a smooth force opposing the motion, given as the momentum it takes out;
* `SmoothLaw`: any other smooth force of gap, gap rate, volts and time;
* `ImpactLaw`: how fast a foot departs after an impact;
* `AdhesionLaw`: how strongly a foot in contact is held;
* `FrictionLaw`: how much force along the ground a contact bears.

Forces are positive along the ground normal (they push the foot away), gaps are positive when open, a
negative gap rate approaches.  The functions are compiled, so they may use arithmetic, ``if``, ``math.*``
and nothing else.

What a law is called and where it stands are class variables; layout, binding, series, account and report
are made from them.
"""

from __future__ import annotations

import inspect
import math
import re
from collections.abc import Callable, Mapping, Sequence
from functools import lru_cache
from itertools import product
from types import FunctionType
from typing import Any, ClassVar, Self

from pydantic import model_validator

from tarsus.base.messages import PathErrors
from tarsus.base.spec import Description

DISSERTATION = (
    "Foot Impact and Dynamic Analyses of Piezoelectrically-Actuated Walking Micro-Robots, dissertation, "
    "University of Michigan"
)
"""Where most laws of the library come from."""


class Law(Description):
    """Base of every ground law; its fields are float quantities, and the literal ``kind`` of a choice of laws."""

    hook: ClassVar[str | None] = None
    """Where the engine calls the function: `momentum` and `force` add up over laws, of the others one acts; None for
    a law that the engine does not call."""
    function_name: ClassVar[str | None] = None
    """Name of the law's function; None for laws that are only parameters."""
    leading: ClassVar[tuple[str, ...]] = ()
    """What the function takes before the parameters."""
    also: ClassVar[Mapping[str, tuple[str, ...]]] = {}
    """Functions that a law may define besides, each of the name of its hook, and what these take before the
    parameters."""
    slot: ClassVar[str | None] = None
    """The field of the ground that the law stands in; without one it stands among ``ground.laws``. Laws that share a
    slot are distinguished by a field ``kind``."""
    slot_note: ClassVar[str | None] = None
    """What the slot is for, and what holds while it is empty."""
    slot_default: ClassVar[bool] = False
    """Of laws that share a slot, the one that is meant where no ``kind`` is given."""
    title: ClassVar[str] = ""
    """The law in words, for reports: a noun without its article. The name of the class, unless given."""
    source: ClassVar[str] = ""
    """What to cite for the law, as ``run.citations()`` does: "Title, what it is, where, year"."""
    small: ClassVar[bool] = False
    """Whether ``ground.near_field_forces = false`` leaves the law out of its slot."""
    loses: ClassVar[bool] = False
    """Whether the law only takes energy: its line in reports is a loss."""
    needs_electrode: ClassVar[bool] = False
    """Whether the law acts on no foot without an electrode."""
    needs_strength: ClassVar[bool] = False
    """Whether the law acts only where a contact has a strength."""
    length_scale: ClassVar[tuple[str, ...]] = ()
    """Fields whose sum [m] is the gap over which the law changes, a scale of lengths besides those of the structure."""
    force_scale: ClassVar[tuple[str, ...]] = ()
    """Fields whose sum [N] is the force of the law, a scale of forces besides those of the structure."""

    @classmethod
    def __pydantic_init_subclass__(cls, **kwargs: Any) -> None:
        super().__pydantic_init_subclass__(**kwargs)
        for name in cls.names():
            field = cls.model_fields[name]
            extra = field.json_schema_extra
            if field.annotation is not float or not isinstance(extra, dict) or "unit" not in extra:
                raise TypeError(
                    f"{cls.__name__}.{name}: a law's field is a float with a unit, written "
                    f"{name}: float = quantity('N', 'what it is')"
                )
        for field in (*cls.length_scale, *cls.force_scale):
            if field not in cls.names():
                raise TypeError(f"{cls.__name__}: its scales name '{field}', which is no field of it")
        if "title" not in cls.__dict__:
            cls.title = cls.name().replace("_", " ")
        for function, leading in {cls.function_name or "": cls.leading, **cls.also}.items():
            own = cls.__dict__.get(function)
            if isinstance(own, FunctionType):
                own = staticmethod(own)
                setattr(cls, function, own)
            if own is not None:
                _check_arguments(cls, function, own.__func__, leading)

    @classmethod
    def by_volts(cls) -> bool:
        """Whether the function takes the volts of the foot's electrode."""
        return "volts" in cls.leading

    @classmethod
    def name(cls) -> str:
        """Name of the law in files and on the command line: the class name in snake_case."""
        return _in_snake_case(cls.__name__)

    @classmethod
    def function(cls) -> Callable[..., float] | None:
        """The law's plain Python function, or None for a law that is only parameters."""
        return getattr(cls, cls.function_name, None) if cls.function_name else None

    @classmethod
    def functions(cls) -> dict[str, tuple[Callable[..., float], int]]:
        """The law's plain functions by hook, each with how many numbers it takes before the parameters."""
        own = {} if cls.hook is None or cls.function() is None else {cls.hook: (cls.function(), len(cls.leading))}
        more = {hook: (getattr(cls, hook, None), len(leading)) for hook, leading in cls.also.items()}
        return {hook: (of, count) for hook, (of, count) in {**own, **more}.items() if of is not None}

    @classmethod
    def label(cls) -> str:
        """Line of the law in an energy account: its work on the structure, or what is lost to it."""
        return f"{'lost to' if cls.loses else 'work of'} the {cls.title}"

    @classmethod
    def names(cls) -> tuple[str, ...]:
        """Names of the parameters: of all fields but ``kind``, in field order."""
        return tuple(name for name in cls.model_fields if name != "kind")

    def parameters(self) -> tuple[float, ...]:
        """Values of the fields, in field order, as the law's function takes them."""
        return tuple(getattr(self, name) for name in self.names())

    def evaluate(self, *arguments: float, hook: str | None = None) -> float:
        """What the law's function, or that of another hook, gives with these parameters; see its protocol."""
        function = self.function() if hook is None else self.functions()[hook][0]
        assert function is not None
        return function(*arguments, *self.parameters())


@lru_cache
def _in_snake_case(name: str) -> str:
    return re.sub(r"(?<=[a-z0-9])(?=[A-Z])|(?<=[A-Z])(?=[A-Z][a-z])", "_", name).lower()


def _check_arguments(cls: type[Law], name: str, function: Callable[..., float], leading: Sequence[str]) -> None:
    expected = (*leading, *cls.names())
    taken = list(inspect.signature(function).parameters)
    if len(taken) != len(expected):
        raise TypeError(
            f"{cls.__name__}.{name}: takes ({', '.join(taken)}), but must take "
            f"({', '.join(expected)}): the leading ones, then every field in order"
        )


class DampingLaw(Law):
    """A force ``-D(gap) * gap_rate`` with ``D >= 0``, given as the total derivative of a momentum.

    A subclass defines ``momentum(gap, *parameters)`` [N s]; the force along the normal is
    ``d/dt momentum(gap(t)) = momentum'(gap) * gap_rate``, so ``D = -momentum'``.
    """

    hook = "momentum"
    function_name = "momentum"
    leading = ("gap",)
    loses = True
    momentum: ClassVar[Callable[..., float]]


class SmoothLaw(Law):
    """A smooth force; a subclass defines ``force(gap, gap_rate, volts, time, *parameters)`` [N]."""

    hook = "force"
    function_name = "force"
    leading = ("gap", "gap_rate", "volts", "time")
    uses_rate: ClassVar[bool] = True
    """False when the force does not depend on ``gap_rate``: it is then solved faster."""
    force: ClassVar[Callable[..., float]]


class ImpactLaw(Law):
    """An instantaneous impact; a subclass defines ``rebound(speed, *parameters)`` [m/s].

    ``speed > 0`` is the approach speed just before; the departing speed returned is ``>= 0``.
    """

    hook = "rebound"
    function_name = "rebound"
    leading = ("speed",)
    rebound: ClassVar[Callable[..., float]]


class AdhesionLaw(Law):
    """A hold on a foot in contact; a subclass defines ``strength(age, *parameters)`` [N].

    ``age`` [s] is the time since the contact began.  A foot is captured when the structure's pull on it at
    impact is at most ``strength(0)``, and leaves when the pull exceeds ``strength(age)``.

    A law whose strength is commanded says ``leading = ("age", "volts")`` and takes the volts of the foot's electrode
    [V] as well: a foot that pulls harder than they hold leaves at the moment at which they fall.

    A contact may remember those before it: with ``remaining(age, away, *parameters)`` [s], what is left of the ``age``
    that a contact had when it ended after ``away`` [s] in the air, the next one begins at that age, not at 0.  One
    number a foot is remembered, and any one that flows by itself in contact is a function of such an age.  For times
    in a row ``remaining(remaining(age, s), t) = remaining(age, s + t)``; of no age nothing is left.

    Raises PathErrors where ``remaining`` is not so at some ages and times.
    """

    hook = "strength"
    function_name = "strength"
    leading = ("age",)
    also: ClassVar[Mapping[str, tuple[str, ...]]] = {"remaining": ("age", "away")}
    strength: ClassVar[Callable[..., float]]
    remaining: ClassVar[Callable[..., float] | None] = None

    @model_validator(mode="after")
    def _flows(self) -> Self:
        remaining, parameters = self.remaining, self.parameters()
        if remaining is None:
            return self

        def left(age: float, away: float) -> float:
            return remaining(age, away, *parameters)

        for age, one, other in product((1e-4, 1e-2, 1.0), (0.0, 1e-4, 1e-2), (1e-4, 1e-2)):
            at_once, in_a_row, of_none = left(age, one + other), left(left(age, one), other), left(0.0, other)
            flows = math.isclose(at_once, in_a_row, rel_tol=1e-6, abs_tol=1e-9 * age)
            if not flows or of_none != 0.0 or not 0.0 <= at_once <= age * (1.0 + 1e-9):
                why = (
                    f"remaining is no flow of time: of an age of {age:g} s, {at_once:g} s are left after "
                    f"{one + other:g} s in the air, {in_a_row:g} s after {one:g} s and then {other:g} s; "
                    f"of no age, {of_none:g} s"
                )
                raise PathErrors([("", why)])
        return self


class FrictionLaw(Law):
    """Friction along the ground; a subclass defines ``bound(margin, strength, speed, *parameters)`` [N], not negative.

    ``margin`` [N] is ``N + f_a``, by which the contact holds: the ground's push and the strength of adhesion;
    ``strength`` [N] is ``f_a`` alone; ``speed`` [m/s], not negative, is the foot's along the ground, 0 where it sticks.
    A foot sticks while the force needed is at most the bound at speed 0, and slides against the bound at its speed
    otherwise.  An impact brakes a foot by at most the bound at the change of its normal velocity in place of the
    margin, without strength, at the speed that it had before.

    A law whose bound does not depend on the speed says ``leading = ("margin", "strength")`` and takes these two alone:
    its sliding is then solved faster.

    Raises PathErrors where the bound is negative at some margin, strength and speed.
    """

    hook = "friction"
    function_name = "bound"
    leading = ("margin", "strength", "speed")
    bound: ClassVar[Callable[..., float]]

    @model_validator(mode="after")
    def _brakes(self) -> Self:
        probes = {"margin": (0.0, 1e-6, 1e-3), "strength": (0.0, 1e-6), "speed": (0.0, 1e-6, 1e-3, 1.0)}
        for point in product(*(probes[name] for name in self.leading)) if self.function() else ():
            if self.evaluate(*point) < 0.0:
                at = ", ".join(f"{name} {value:g}" for name, value in zip(self.leading, point, strict=True))
                raise PathErrors([("", f"bound is negative at {at}: friction brakes, it never drives")])
        return self
