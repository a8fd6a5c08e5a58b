"""The environments: one robot, and many at once, which are the same robots."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import gymnasium
import numpy as np
from gymnasium.vector import AutoresetMode, VectorEnv
from numpy.typing import NDArray

from tarsus.base.errors import InputError
from tarsus.base.expressions import Expression
from tarsus.base.units import parse_quantity
from tarsus.files.library import SceneLike, as_scene
from tarsus.learn.actions import Action, VoltageAction
from tarsus.learn.sensors import Sensors
from tarsus.measure.counts import COUNTS
from tarsus.model.scene import Scene
from tarsus.solve import Session, State

Floats = NDArray[np.float64]


class _Robots:
    """What both environments are made of: robots, their actions, what is seen of them and what it is worth."""

    def __init__(
        self,
        scene: SceneLike,
        robots: int,
        actions: Action | None,
        sensors: Sensors | None,
        ground: Any,
        reward: str,
        dt: float | str,
        steps: int,
        threads: int | None,
    ) -> None:
        for name, given, kind, wanted in (
            ("actions", actions, Action, "one such as PhaseAction()"),
            ("sensors", sensors, Sensors, "one such as Sensors()"),
            ("ground", ground, Mapping | Callable, "a GroundBox, Draws.of(file), or values by path"),
            ("reward", reward, str, "arithmetic as a text"),
        ):
            if given is not None and not isinstance(given, kind):
                raise InputError(f"{name}: expected {wanted}, got {given!r:.60}")
        own = as_scene(scene)
        self.actions = _volts_of(own) if actions is None else actions
        self.scene: Scene = self.actions.prepared(own)
        self.sensors = sensors or Sensors()
        self.seconds = parse_quantity(dt, "s") if isinstance(dt, str) else float(dt)
        if steps < 1:
            raise InputError(f"steps: expected one or more, got {steps}")
        self.steps, self.reward = steps, Expression(reward)
        walks = bool(self.scene.robot.structure.body_coordinates)
        if problems := self.reward.check((*COUNTS, *(("progress",) if walks else ()))):
            raise InputError([f"reward: {text}" for text in problems])
        self.session = Session(self.scene, robots, ground, threads=threads)
        self.done = np.zeros(robots, dtype=np.intp)

    def spaces(self) -> tuple[gymnasium.spaces.Box, gymnasium.spaces.Box]:
        """Of actions and of what is seen."""
        acted, seen = self.actions.size(self.scene), len(self.sensors.names(self.scene))
        return (
            gymnasium.spaces.Box(-1.0, 1.0, (acted,), np.float32),
            gymnasium.spaces.Box(-np.inf, np.inf, (seen,), np.float32),
        )

    def _action(self, action: Any) -> Floats:
        """An action (nr, size) as numbers. Raises InputError for another shape, and for what is no finite number."""
        robots, size = len(self.done), self.actions.size(self.scene)
        try:
            given = np.asarray(action, dtype=float)
        except (TypeError, ValueError):
            raise InputError([f"action: expected {size} numbers from -1 to 1, got {action!r:.60}"]) from None
        if given.shape not in {(robots, size)} | ({(size,)} if robots == 1 else set()):
            each = f"{size} numbers" if robots == 1 else f"{robots} rows of {size} numbers, one a robot,"
            got = " x ".join(map(str, given.shape)) or "one number"
            raise InputError([f"action: expected {each} from -1 to 1, got {got}"])
        if not np.isfinite(given).all():
            raise InputError(["action: every number must be finite"])
        return given.reshape(robots, size)

    def reset(self, seed: int | None, robots: NDArray[np.bool_] | None = None) -> State:
        self.done[slice(None) if robots is None else robots] = 0
        return self.session.reset(seed, robots=robots)

    def step(self, action: Any) -> tuple[State, Floats, NDArray[np.bool_], NDArray[np.bool_]]:
        """State, rewards, who has stopped and who has come to the end of an episode."""
        commands = self.actions.commands(self.scene, self._action(action), self.seconds)
        state = self.session.step(dt=self.seconds, **commands)
        self.done += 1
        reward = np.broadcast_to(self.reward.values(state.measures), self.done.shape)
        return state, np.nan_to_num(reward, nan=0.0), ~state.ok, self.done >= self.steps


class WalkerEnv(gymnasium.Env[Any, Any]):
    """One robot as an environment, ``tarsus/Walker-v0``.

    Parameters
    ----------
    scene
        A scene, or a device's name or a scene file's path.
    actions
        What the agent commands: `VoltageAction`, `PhaseAction` or `SwitchingAction`; unless given, volts between those
        of the gait.
    sensors
        What the agent sees, `Sensors`.
    ground
        What is drawn at every reset: a `GroundBox`, `Draws` of an identification, or what `tarsus.Session` takes as
        ``vary``.
    reward
        Arithmetic of what a step came to: names in `tarsus.measure.counts.COUNTS`, and of a walker ``progress`` [m].
    dt
        Length of a step [s], or a text with a unit.
    steps
        Steps of an episode.

    Raises
    ------
    InputError
        For what does not fit the scene.

    A robot that stops before the end of a step (a pile of events, friction without a solution) has terminated.
    """

    metadata = {"render_modes": []}  # noqa: RUF012  # Gymnasium's own attribute

    def __init__(
        self,
        scene: SceneLike = "hexapod-walker",
        actions: Action | None = None,
        sensors: Sensors | None = None,
        ground: Mapping[str, Any] | Callable[..., Mapping[str, Any]] | None = None,
        reward: str = "progress * 1e6",
        dt: float | str = "1 ms",
        steps: int = 200,
        render_mode: None = None,
    ) -> None:
        self.render_mode = render_mode
        self.robots = _Robots(scene, 1, actions, sensors, ground, reward, dt, steps, 1)
        self.action_space, self.observation_space = self.robots.spaces()

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> tuple[Any, dict[str, Any]]:
        """As `gymnasium.Env.reset`: what is seen, and the ground that was drawn."""
        super().reset(seed=seed)
        seen = self.robots.sensors.seen(self.robots.reset(seed))[0]
        return seen, {"ground": {path: float(of[0]) for path, of in self.robots.session.values.items()}}

    def step(self, action: Any) -> tuple[Any, float, bool, bool, dict[str, Any]]:
        """As `gymnasium.Env.step`; info: time [s] and what the reward is made of."""
        state, reward, stopped, ended = self.robots.step(action)
        info = {"time": float(state.time[0]), **{name: float(of[0]) for name, of in state.measures.items()}}
        return self.robots.sensors.seen(state)[0], float(reward[0]), bool(stopped[0]), bool(ended[0]), info


class WalkerVectorEnv(VectorEnv[Any, Any, Any]):
    """Many robots as one environment, on the batch: `WalkerEnv` in all else. An episode that ends begins anew in the
    same step (`gymnasium.vector.AutoresetMode.SAME_STEP`)."""

    metadata = {"render_modes": [], "autoreset_mode": AutoresetMode.SAME_STEP}  # noqa: RUF012

    def __init__(
        self,
        num_envs: int = 1,
        scene: SceneLike = "hexapod-walker",
        actions: Action | None = None,
        sensors: Sensors | None = None,
        ground: Mapping[str, Any] | Callable[..., Mapping[str, Any]] | None = None,
        reward: str = "progress * 1e6",
        dt: float | str = "1 ms",
        steps: int = 200,
        threads: int | None = None,
    ) -> None:
        self.num_envs = num_envs
        self.robots = _Robots(scene, num_envs, actions, sensors, ground, reward, dt, steps, threads)
        self.single_action_space, self.single_observation_space = self.robots.spaces()
        batched = gymnasium.vector.utils.batch_space
        self.action_space = batched(self.single_action_space, num_envs)
        self.observation_space = batched(self.single_observation_space, num_envs)

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> tuple[Any, dict[str, Any]]:
        """As `gymnasium.vector.VectorEnv.reset`; info: the grounds that were drawn, (num_envs,) by path."""
        super().reset(seed=seed)
        seen = self.robots.sensors.seen(self.robots.reset(seed))
        return seen, {"ground": self.robots.session.values}

    def step(self, actions: Any) -> tuple[Any, Floats, NDArray[np.bool_], NDArray[np.bool_], dict[str, Any]]:
        """As `gymnasium.vector.VectorEnv.step`; info: what the rewards are made of, and what was last seen of robots
        that begin anew."""
        state, reward, stopped, ended = self.robots.step(actions)
        seen = self.robots.sensors.seen(state)
        info: dict[str, Any] = dict(state.measures)
        over = stopped | ended
        if over.any():
            info |= {"final_obs": seen, "_final_obs": over}
            fresh = self.robots.sensors.seen(self.robots.reset(None, over))
            seen = np.where(over[:, None], fresh, seen)
        return seen, reward, stopped, ended, info


def _volts_of(scene: Scene) -> VoltageAction:
    """Between the voltages of the scene's gait. Raises InputError where there is none."""
    if scene.gait is None:
        raise InputError("actions: give VoltageAction(low, high), for the scene has no gait that says between which")
    return VoltageAction(scene.gait.low, scene.gait.high)
