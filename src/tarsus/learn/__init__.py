"""Robots as environments of Gymnasium, one or thousands at once: ``tarsus/Walker-v0`` (extra ``learn``)."""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

from tarsus.learn.actions import PhaseAction, SwitchingAction, VoltageAction
from tarsus.learn.grounds import Draws, GroundBox
from tarsus.learn.sensors import Sensors

if TYPE_CHECKING:
    from tarsus.learn.walkers import WalkerEnv, WalkerVectorEnv

__all__ = [
    "Draws",
    "GroundBox",
    "PhaseAction",
    "Sensors",
    "SwitchingAction",
    "VoltageAction",
    "WalkerEnv",
    "WalkerVectorEnv",
    "register",
]

ID = "tarsus/Walker-v0"


def register() -> None:
    """Register the environments with Gymnasium, which it calls itself by the entry point ``gymnasium.envs``; again does
    nothing. Raises ImportError where Gymnasium is not installed."""
    from gymnasium.envs import registration

    if ID not in registration.registry:
        own = registration.current_namespace is None
        registration.register(
            ID if own else ID.partition("/")[2],
            entry_point="tarsus.learn.walkers:WalkerEnv",
            vector_entry_point="tarsus.learn.walkers:WalkerVectorEnv",
        )


def __getattr__(name: str) -> Any:
    if name not in ("WalkerEnv", "WalkerVectorEnv"):
        raise AttributeError(f"module 'tarsus.learn' has no attribute '{name}'")
    return getattr(import_module("tarsus.learn.walkers"), name)
