import copy
import math
import pickle
from dataclasses import FrozenInstanceError
from typing import Annotated, Literal

import numpy as np
import pytest
from pydantic import Field

from tarsus.base.errors import InputError
from tarsus.base.spec import (
    Description,
    FloatInfo,
    FrozenDict,
    Named,
    float_paths,
    get_value,
    quantity,
    validate,
    with_values,
)
from tarsus.files.library import load_scene


class Layer(Description):
    coefficient: float = quantity("N m^2 s", "film coefficient", ge=0)
    thickness: float = quantity("m", "residual thickness", gt=0)


class Wave(Description):
    kind: Literal["wave"] = "wave"
    amplitude: float = quantity("V", "amplitude")


class Step(Description):
    kind: Literal["step"] = "step"
    level: float = quantity("V", "level")


class Shake(Description):
    kind: Literal["shake"] = "shake"
    amplitude: float = quantity("m", "way", default=1e-3)


class Whole(Description):
    name: str
    layer: Layer | None = None
    signals: Named[Annotated[Wave | Step | Shake, Field(discriminator="kind")]] = FrozenDict()
    ratios: tuple[float, ...] = quantity("1", "damping ratio", ge=0)
    shapes: Named[tuple[float, ...]] = quantity("1", "shape", default=FrozenDict())
    count: int = 1


def places(error: InputError) -> list[str]:
    """Where problems are; their words stand in full in test_toml."""
    return [one.split(":")[0] for one in error.problems]


def whole() -> Whole:
    return Whole(
        name="it",
        layer=Layer(coefficient="1.747e-15 uN m^2 s", thickness="58 um"),
        signals={"pzt": Wave(amplitude=8)},
        ratios=[0.1, "2 %"],
        shapes={"tip": np.array([1.0, -1.0])},
    )


def test_float_paths_have_unit_and_meaning() -> None:
    assert float_paths(whole()) == {
        "layer.coefficient": FloatInfo(1.747e-21, "N m^2 s", "film coefficient"),
        "layer.thickness": FloatInfo(58e-6, "m", "residual thickness"),
        "signals.pzt.amplitude": FloatInfo(8.0, "V", "amplitude"),
        "ratios.0": FloatInfo(0.1, "1", "damping ratio"),
        "ratios.1": FloatInfo(0.02, "1", "damping ratio"),
        "shapes.tip.0": FloatInfo(1.0, "1", "shape"),
        "shapes.tip.1": FloatInfo(-1.0, "1", "shape"),
    }


@pytest.mark.parametrize(
    ("device", "changes", "wanted"),
    [
        ("millipede", {"gait.kind": "ripple"}, {"gait.kind": "ripple", "gait.high": "as it was"}),
        ("millipede", {"gait.kind": "free", "gait.phases": {}}, "gait.phases: "),
        (
            "hamr-like",
            {"ground.friction.kind": "static_kinetic", "ground.friction.static": 0.5},
            "ground.friction.kinetic: missing",
        ),
        ("millipede", {"gait.kind": "wav"}, "gait.kind: unknown kind 'wav'; did you mean 'wave'?"),
        ("cantilever", {"signals.pzt.kind": "sine"}, {"signals.pzt.amplitude": "as it was"}),
    ],
)
def test_another_kind_keeps_what_both_have(device, changes, wanted) -> None:
    """What is set beside the kind is of the new one, and what is missing is said as of a file."""
    scene = load_scene(device)
    if isinstance(wanted, str):
        with pytest.raises(InputError) as said:
            with_values(scene, changes)
        assert any(one.startswith(wanted) for one in said.value.problems), said.value
        return
    made = with_values(scene, changes)
    for path, value in wanted.items():
        assert get_value(made, path) == (get_value(scene, path) if value == "as it was" else value)


def test_another_kind_keeps_no_number_of_another_unit() -> None:
    assert get_value(with_values(whole(), {"signals.pzt.kind": "shake"}), "signals.pzt.amplitude") == 1e-3


def test_with_values_takes_units_tables_and_none() -> None:
    changed = with_values(
        whole(),
        {
            "layer": None,
            "signals.pzt": {"kind": "step", "level": "3 V"},
            "signals.other": Wave(amplitude=1.0),
            "ratios.1": "5 %",
            "count": 7,
        },
    )
    assert changed.layer is None
    assert changed.signals == {"pzt": Step(level=3.0), "other": Wave(amplitude=1.0)}
    assert changed.ratios == (0.1, 0.05)
    assert changed.count == 7


def test_with_values_reports_everything_at_once() -> None:
    with pytest.raises(InputError) as caught:
        with_values(
            with_values(whole(), {"shapes": {}}),
            {
                "layer.coeficient": 1.0,
                "layer.thickness": -1.0,
                "ratios.2": 0.1,
                "signals.pz.amplitude": 1.0,
                "name.first": 1.0,
                "count": 1.5,
            },
        )
    assert places(caught.value) == [
        "layer.coeficient",
        "layer.thickness",
        "ratios.2",
        "signals.pz.amplitude",
        "name.first",
        "count",
    ]
    assert "did you mean 'layer.coefficient'" in caught.value.problems[0]
    assert "'name' is one value" in caught.value.problems[4]


def test_a_value_and_something_inside_it() -> None:
    for values in ({"layer": None, "layer.thickness": 1.0}, {"layer.thickness": 1.0, "layer": None}):
        with pytest.raises(InputError, match="give one of the two"):
            with_values(whole(), values)


def test_a_wrong_table_gives_all_its_errors_at_once() -> None:
    table = {
        "name": 3,
        "layer": {"coefficient": "-1 N m^2 s", "thicknes": 1},
        "signals": {
            "a": {"kind": "wve"},
            "b": {"kind": "wave"},
            "c": {"kind": "step", "level": "8 m"},
            "d.e": {"kind": "wave", "amplitude": 1},
            "f": {},
            "g": 3,
        },
        "ratios": [math.nan, "-2 %"],
        "shapes": {"tip": ["a", 1], "c": 2},
        "zork": 1,
    }
    with pytest.raises(InputError) as caught:
        validate(Whole, table)
    said = {
        "name": "a text, got 3",
        "layer.coefficient": "at least 0, got -1 N m^2 s",
        "layer.thickness": "missing; expected",
        "layer.thicknes": "did you mean 'thickness'",
        "signals.a.kind": "did you mean 'wave'",
        "signals.b.amplitude": "missing; expected",
        "signals.c.level": "which is a length",
        "signals.d.e": "ASCII letters",
        "signals.f": "with a 'kind'",
        "signals.g": "a table, got 3",
        "ratios.0": "finite, got nan",
        "ratios.1": "got -2 %",
        "shapes.tip.0": "not a number with a unit",
        "zork": "valid names are",
        "signals.a.amplitude": "missing; expected",
        "shapes.c": "a list, got 2",
    }
    assert places(caught.value) == list(said)
    assert [one for word, one in zip(said.values(), caught.value.problems, strict=True) if word not in one] == []


def test_long_lists_are_checked_too() -> None:
    values = [0.1] * 200
    assert Whole(name="it", ratios=values).ratios == tuple(values)
    with pytest.raises(InputError, match=r"ratios\.7: .* got -1\.0"):
        Whole(name="it", ratios=[*values[:7], -1.0, *values])
    with pytest.raises(InputError, match=r"ratios\.3: .* finite"):
        Whole(name="it", ratios=[*values[:3], math.nan, *values])


def test_descriptions_are_frozen_values() -> None:
    it = whole()
    assert it == whole()
    assert hash(it) == hash(whole())
    assert it != with_values(it, {"count": 2})
    assert pickle.loads(pickle.dumps(it)) == it
    assert copy.deepcopy(it) == it
    with pytest.raises(TypeError, match="frozen"):
        it.signals["new"] = Wave(amplitude=1.0)
    with pytest.raises(FrozenInstanceError, match="Whole is frozen: change name in a copy"):
        it.name = "other"  # type: ignore[misc]


@pytest.mark.parametrize(
    "values", [{"thickness": 5e-324}, {"thickness": 1e-61}, {"thickness": 1e61}, {"coefficient": 1e61}]
)
def test_sizes_whose_products_are_no_numbers_are_refused(values):
    with pytest.raises(InputError, match=r"with a size from 1e-60 to 1e\+60 in SI, got"):
        Layer(**{"coefficient": 1e-20, "thickness": 1e-5} | values)
    assert Layer(coefficient=1e-300, thickness=1e-60).coefficient == 1e-300, "as good as nothing, which it may be"
