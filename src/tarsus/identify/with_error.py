"""A number of an instrument with its standard error, and whether it is off what was stated."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

_SURE = 4.0
"""Standard errors that a difference must have."""


@dataclass(frozen=True)
class WithError:
    """A number and its standard error (infinite where the record does not tell it)."""

    value: float
    error: float

    @property
    def moved(self) -> WithError:
        """One standard error more."""
        return replace(self, value=self.value + self.error)

    def off(self, stated: float, limit: float) -> bool:
        """Whether it differs from what was stated by more than a limit, and for sure."""
        return abs(self.value - stated) > max(limit, _SURE * self.error)

    def beyond(self, stated: float, limit: float) -> float:
        """The number where it is off what was stated (`off`), else what was stated."""
        return self.value if self.off(stated, limit) else stated


UNKNOWN = WithError(0.0, np.inf)
"""What no record shows: it differs from nothing."""
