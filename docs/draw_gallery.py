"""Draw the pictures of the gallery from the examples that tests run, and the moving ones of the notebooks:
`python docs/draw_gallery.py`."""

from __future__ import annotations

import sys
from collections.abc import Callable
from importlib.util import module_from_spec, spec_from_file_location
from pathlib import Path
from types import ModuleType

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

import tarsus as ts
from tarsus.report.style import CYCLE, INK, MUTED

TARGET = Path(__file__).with_name("gallery")
NOTEBOOKS = Path(__file__).with_name("notebooks")
EXAMPLES = Path(__file__).parents[1] / "examples"

Picture = Callable[[Axes], None]


def example(name: str) -> ModuleType:
    """An example as a module; what it reads and prints is its own affair."""
    spec = spec_from_file_location(name, EXAMPLES / f"{name}.py")
    assert spec and spec.loader
    module = module_from_spec(spec)
    sys.modules[name] = module  # dataclasses look their module up
    spec.loader.exec_module(module)
    return module


def ball(axes: Axes) -> None:
    run = ts.simulate(
        ts.with_values(
            ts.read_scene(EXAMPLES / "scenes" / "bouncing_ball.toml"), {"ground.restitution.coefficient": 0.7}
        ),
        2.7,
    )
    found = run.variables(np.linspace(0.0, 2.7, 2001))
    axes.plot(found["time"].values, found["gap"].values[0], color=CYCLE[0], lw=1.2)
    axes.axvline(example("bouncing_ball").time_of_rest(0.7), color=MUTED, lw=0.8, ls="--")
    axes.set(xlabel="time (s)", ylabel="height (m)", ylim=(0.0, None))


def magnet(axes: Axes) -> None:
    for strength, color in zip((0.0, 1e-24, 3e-24), CYCLE, strict=False):
        run = example("own_law").run_with_magnet(strength)
        found = run.variables(np.linspace(0.008, 0.022, 2001))
        label = f"K = {strength:.0e} N m⁴" if strength else "no magnet"
        axes.plot(found["time"].values * 1e3, found["gap"].values[0] * 1e6, lw=1.1, color=color, label=label)
    axes.set(xlabel="time (ms)", ylabel="gap of the tip (µm)", ylim=(0.0, 265.0))
    axes.legend(frameon=False, ncols=3, loc="upper right")


def film(axes: Axes) -> None:
    scales = np.geomspace(0.1, 100.0, 256)
    axes.semilogx(scales, example("film_sweep").impacts_over_film(scales), ".", ms=3, color=CYCLE[0])
    axes.set(xlabel="film, times the packaged one", ylabel="impacts in 0.1 s", ylim=(0, None))


def thirty_legs(axes: Axes) -> None:
    own = example("thirty_legs")
    for (label, run), color in zip(
        {
            "all alike": own.walk(),
            "scattered by 10 %": own.walk(scatter=0.1),
            "and three dead": own.walk(scatter=0.1, dead=own.DEAD),
        }.items(),
        CYCLE,
        strict=False,
    ):
        found = run.variables()
        axes.plot(found["time"].values * 1e3, found["body"].values[0] * 1e6, color=color, lw=1.2, label=label)
    axes.set(xlabel="time (ms)", ylabel="travel (µm)")
    axes.legend(frameon=False)


def quadruped(axes: Axes) -> None:
    own, hz = example("trotting_quadruped"), np.arange(10.0, 72.0, 2.0)
    axes.plot(hz, own.speeds(hz), ".-", color=CYCLE[0], lw=0.9, label="predicted, nothing fitted")
    axes.axhline(own.MEASURED, color=INK, lw=0.8, ls="--", label="measured at best")
    axes.set(xlabel="stride frequency (Hz)", ylabel="speed (m/s)")
    axes.legend(frameon=False)


def millipede_ground(axes: Axes) -> None:
    own, rates = example("millipede_ground"), np.geomspace(1e-5, 1e-1, 33)
    for coefficient, color in zip((1e-19, 1e-17, 1e-16), CYCLE, strict=False):
        stride = own.strides(rates, np.array([coefficient]))[:, 0]
        axes.semilogx(rates * 1e3, stride * 1e6, ".-", lw=0.9, color=color, label=f"$C_e$ = {coefficient:.0e} N m²/V²")
    axes.axvline(own.expected_rate(ts.load_scene("millipede-table")) * 1e3, color=INK, lw=0.8, ls="--", label="by hand")
    axes.set(xlabel="growth of adhesion (mN/s)", ylabel="stride (µm)")
    axes.legend(frameon=False)


def switch(axes: Axes) -> None:
    design = ts.design.landing(
        ts.load_scene("mems-switch"), "beam", pairs=1, levels="0 V, 90 V", tick=10e-9, shortest=1e-6, effort=0.4
    )
    ts.plot.landing(design, axes=axes)
    axes.set(title="", xlim=(0.0, 60e-6))


def cantilever(axes: Axes) -> None:
    ts.plot.motion(ts.simulate(ts.load_scene("cantilever"), 0.06), axes=axes)
    axes.set_title("")


PICTURES: dict[str, Picture] = {
    "bouncing-ball": ball,
    "own-law": magnet,
    "film-sweep": film,
    "thirty-legs": thirty_legs,
    "quadruped": quadruped,
    "millipede-ground": millipede_ground,
    "switch": switch,
    "cantilever": cantilever,
}
"""Pictures by the names of their files."""


def draw(name: str, folder: Path = TARGET) -> Path:
    """Draw a picture into a folder; the same example always gives the same picture."""
    with matplotlib.rc_context({"font.size": 9.0, "axes.spines.top": False, "axes.spines.right": False}):
        figure = Figure(figsize=(7.0, 2.9), dpi=110, layout="constrained")
        PICTURES[name](figure.add_subplot())
        target = folder / f"{name}.png"
        figure.savefig(target, metadata={"Software": None})
    return target


def own_bouncing() -> ts.Run:
    """The ball of the notebook for theorists, on its orbit of period one."""
    gamma = 1.5
    phase = float(np.arccos(np.pi / 3.0 / gamma))
    start = [0.5 - gamma * float(np.cos(phase)) / (2.0 * np.pi)]
    table = ts.read_scene(Path(__file__).parents[1] / "tests" / "scenes" / "vibrating_table.toml")
    own = {"signals.table.amplitude": gamma, "signals.table.phase": phase, "initial.velocity": start}
    return ts.simulate(ts.with_values(table, own), 4.0)


ROUGH = {"kind": "random", "seed": 3, "rms": "0.5 um", "correlation_length": "300 um", "hurst": 0.8, "spacing": "40 um"}
MOVIES: dict[str, Callable[[], ts.Run]] = {
    "experimentalist": lambda: ts.simulate("cantilever", "0.1 s"),
    "designer": lambda: ts.simulate("hamr-like", "0.4 s"),
    "walker": lambda: ts.simulate(
        ts.with_values(ts.load_scene("millipede-30"), {"ground.profile": ROUGH, "initial": {"standing": {}}}), "80 ms"
    ),
    "theorist": own_bouncing,
}
"""Runs whose last drive period the first picture of each notebook shows."""


def film_of(name: str, folder: Path = NOTEBOOKS) -> Path:
    """Draw the moving picture of a notebook into a folder."""
    return ts.movie(MOVIES[name](), folder / f"{name}.gif", periods=1, width=560)


if __name__ == "__main__":
    for one in PICTURES:
        print(draw(one))
    for one in MOVIES:
        print(film_of(one))
