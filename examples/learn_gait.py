"""Six legs learn to walk on grounds that they do not know: a gait that feels its way.

A policy says every hundredth of a second how the gait is to go on, from what the body and the feet tell. Its numbers
are found by CMA-ES on grounds drawn anew in every generation, and judged on 200 that it never met, beside the gait of
the device and, which is harder to beat, beside the best of 64 waves that feel nothing.
"""

from __future__ import annotations

from dataclasses import dataclass

import gymnasium
import numpy as np
from numpy.typing import NDArray

import tarsus as ts
from tarsus import learn

Floats = NDArray[np.float64]

GROUND = learn.GroundBox(
    {
        "ground.friction.coefficient": (0.15, 0.8),
        "ground.adhesion.initial": (5e-8, 2e-6),
        "ground.film.coefficient": (3e-25, 1e-23),
        "ground.restitution.coefficient": (0.2, 0.6),
    },
    log=True,
)
ACTIONS = learn.PhaseAction(frequency=(40.0, 160.0), duty=(0.3, 0.7))
SENSORS = learn.Sensors(currents=False)
PERIOD, PERIODS = 0.01, 12
FELT = 3
"""Features that the policy feels: how fast the body went on, its heave, and how many feet were on the ground."""


@dataclass(frozen=True)
class Gaits:
    """So many robots under a policy each, on the same grounds for every policy."""

    policies: int
    grounds: int

    def drawn(self, rng: np.random.Generator, count: int) -> dict[str, Floats]:
        """Every policy meets the same grounds."""
        return {path: np.tile(of, self.policies) for path, of in GROUND(rng, self.grounds).items()}

    def world(self) -> gymnasium.vector.VectorEnv:
        """The environment of all."""
        learn.register()
        return gymnasium.make_vec(
            "tarsus/Walker-v0",
            num_envs=self.policies * self.grounds,
            vectorization_mode="vector_entry_point",
            scene="hexapod-walker",
            actions=ACTIONS,
            sensors=SENSORS,
            ground=self.drawn,
            dt=PERIOD,
            steps=PERIODS + 1,
        )

    def ways(self, world: gymnasium.vector.VectorEnv, numbers: Floats, seed: int) -> Floats:
        """Ways (policies, grounds) [um] of the body in an episode; numbers (policies, np) of the policies."""
        seen, _ = world.reset(seed=seed)
        own = np.repeat(numbers, self.grounds, axis=0)
        way = np.zeros(len(own))
        for _ in range(PERIODS):
            seen, reward, stopped, _, _ = world.step(told(own, seen))
            way += np.where(stopped, 0.0, reward)
        return way.reshape(self.policies, self.grounds)


def size() -> int:
    """How many numbers a policy has: an action to begin with, and what frequency and duty have of what is felt."""
    return ACTIONS.size(_scene()) + 2 * FELT


def told(numbers: Floats, seen: Floats) -> NDArray[np.float32]:
    """Actions (nr, size) of policies (nr, np) that see (nr, ns)."""
    names = SENSORS.names(_scene())
    ahead, heave = seen[:, names.index("surge rate")], seen[:, names.index("heave")]
    feet = seen[:, [k for k, name in enumerate(names) if name.endswith("contact")]].mean(axis=1)
    felt = np.tanh(np.stack([0.2 * ahead, 0.2 * heave, 2.0 * feet - 1.0], axis=1))
    action = numbers[:, : -2 * FELT].copy()
    by = numbers[:, -2 * FELT :].reshape(-1, 2, FELT)
    action[:, -2:] += np.einsum("rkf,rf->rk", by, felt)
    return np.clip(action, -1.0, 1.0).astype(np.float32)


def open_loop() -> Floats:
    """The policy (np,) that is the gait of the device, whatever it feels."""
    scene = ACTIONS.prepared(_scene())
    layout = scene.robot.layout()
    assert layout is not None and scene.gait is not None
    late = [scene.gait.delays(layout)[group[0]] for group in layout.groups]
    shares = [
        (value - low) / (high - low)
        for value, (low, high) in ((scene.gait.frequency, ACTIONS.frequency), (scene.gait.duty, ACTIONS.duty))  # type: ignore[misc]
    ]
    return np.concatenate([2.0 * np.array([*late, *shares]) - 1.0, np.zeros(2 * FELT)])


def waves(count: int, seed: int) -> Floats:
    """Policies (count, np) that feel nothing: each leg is as late as a lag says behind the one after it, and the right
    side than the left one; lags, frequency and duty are drawn evenly."""
    layout = ACTIONS.prepared(_scene()).robot.layout()
    assert layout is not None
    place = {leg: (i, side) for side, legs in enumerate(layout.sides) for i, leg in enumerate(legs)}
    drawn = np.random.default_rng(seed).random((count, 4))
    late = [(drawn[:, :2] @ np.array(place[group[0]])) % 1.0 for group in layout.groups]
    return np.concatenate([2.0 * np.stack([*late, *drawn.T[2:]], axis=1) - 1.0, np.zeros((count, 2 * FELT))], axis=1)


def best_wave(count: int = 64, grounds: int = 6, seed: int = 1) -> Floats:
    """The wave (np,) that goes farthest of so many, on grounds drawn for training."""
    gaits, tried = Gaits(count, grounds), waves(count, seed)
    return tried[int(gaits.ways(gaits.world(), tried, seed).mean(axis=1).argmax())]


def _scene() -> ts.Scene:
    return ts.load_scene("hexapod-walker")


def trained(generations: int = 24, grounds: int = 6, policies: int = 12, seed: int = 1) -> Floats:
    """Numbers (np,) of the policy that CMA-ES finds from the gait of the device on."""
    import cma

    gaits = Gaits(policies, grounds)
    world = gaits.world()
    search = cma.CMAEvolutionStrategy(
        open_loop(), 0.2, {"popsize": policies, "seed": seed, "verbose": -9, "CMA_diagonal": False}
    )
    for generation in range(generations):
        asked = np.array(search.ask())
        ways = gaits.ways(world, asked, seed=1000 * seed + generation)
        search.tell(list(asked), list(-ways.mean(axis=1)))
    return np.asarray(search.result.xfavorite)


def judged(numbers: Floats, wave: Floats, grounds: int = 200, seed: int = 10**6) -> Floats:
    """Ways (4, grounds) [um] of a policy, of the same where it feels nothing, of a wave and of the gait of the device,
    on grounds that no training has drawn."""
    numb = numbers.copy()
    numb[-2 * FELT :] = 0.0
    gaits = Gaits(4, grounds)
    return gaits.ways(gaits.world(), np.stack([numbers, numb, wave, open_loop()]), seed)


if __name__ == "__main__":
    learnt, numb, wave, own = judged(trained(), best_wave()) / (PERIODS * PERIOD)
    print(f"on {len(own)} grounds never met: {learnt.mean():.0f} um/s, where it feels nothing {numb.mean():.0f} um/s")
    print(f"the best of 64 waves: {wave.mean():.0f} um/s, the device's gait {own.mean():.0f} um/s")
    print(f"faster than the wave on {100.0 * np.mean(learnt > wave):.0f} % of them")
