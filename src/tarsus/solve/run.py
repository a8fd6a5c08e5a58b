"""One finished run: events, measures, energy ledger, and the series behind them."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from tarsus.base.errors import InputError
from tarsus.base.events import EventKind
from tarsus.files.ledger import Ledger
from tarsus.measure import Measures, measures_of
from tarsus.model.scene import Scene
from tarsus.plan.lowering import Plan
from tarsus.solve import shown
from tarsus.solve.codes import CLOSED, ResultCode, structured_events
from tarsus.solve.engine import RawRuns

if TYPE_CHECKING:
    import xarray

    from tarsus.core.replay import Integrals, Sampled
    from tarsus.files.series import Variable
    from tarsus.solve.series import Series


def increasing(times: npt.ArrayLike) -> np.ndarray:
    """Times (nt,) [s] as floats. Raises InputError where they are no row in order, which replaying a run needs."""
    when = np.asarray(times, dtype=float)
    if when.ndim != 1:
        raise InputError(f"times: expected a row of times (nt,), got an array of {when.ndim} dimensions")
    if np.any(np.diff(when) < 0.0):
        raise InputError("times: expected times in order, each at or after the one before; sort them first")
    return when


@dataclass(frozen=True, repr=False)
class Run:
    """A finished simulation of ``scene`` over ``duration`` [s].

    code: how it ended; wall_s: seconds it took; period [s]: drive period of the statistics.
    """

    scene: Scene
    plan: Plan
    raw: RawRuns
    duration: float
    period: float
    wall_s: float

    def __repr__(self) -> str:
        return shown.run_line(self)

    def _repr_html_(self) -> str:
        return shown.run_table(self)

    def __getstate__(self) -> dict[str, Any]:
        return shown.state_of(self, self.scene)

    @cached_property
    def code(self) -> ResultCode:
        """How the run ended; its value is a sentence. Of a run that reached its end this asks for the ledger, once:
        by contact modes that takes one to four times as long as the run, of a walker nothing."""
        open_ = self.ended is ResultCode.DONE and not self.ledger.closure <= CLOSED  # NaN is open
        return ResultCode.LEDGER_OPEN if open_ else self.ended

    @property
    def ended(self) -> ResultCode:
        """How the run ended, its energy account aside, which is not asked for: for those who need the motion alone."""
        return ResultCode.of(int(self.raw.codes[0]), makes_energy=self.scene.ground.makes_energy)

    @property
    def ok(self) -> bool:
        """True when the run reached its end with its energy account closed."""
        return self.code is ResultCode.DONE

    @property
    def remarks(self) -> tuple[str, ...]:
        """Sentences on what the run left that its model assumes; none as a rule."""
        return ()

    @property
    def end_time(self) -> float:
        """Time reached [s]; the duration unless the run stopped early."""
        return float(self.raw.finish[0, 0])

    @property
    def foot_names(self) -> tuple[str, ...]:
        """Names of the feet, in the order of the events' foot numbers."""
        return tuple(self.scene.robot.feet)

    @cached_property
    def _all_events(self) -> np.ndarray:
        return structured_events(self.raw.events)

    @property
    def all_events(self) -> np.ndarray:
        """Events with the period marks (kind 6) between them."""
        return self._all_events

    @cached_property
    def events(self) -> np.ndarray:
        """Events in time order, a structured array; see `tarsus.solve.codes.EVENT_TYPE` for fields and units."""
        return self.all_events[self.all_events["kind"] != EventKind.PERIOD_MARK]

    @cached_property
    def measures(self) -> Measures:
        """Measures by drive period after transients; each with definition, unit and spread."""
        return measures_of(self)

    @cached_property
    def series(self) -> Series:
        """States and forces on an even time grid, with the energy integrals of every step."""
        from tarsus.solve.series import sample

        return sample(self)

    @cached_property
    def energies(self) -> Integrals:
        """Energy integrals up to the end of every step of the engine."""
        from tarsus.solve.series import energies

        return energies(self)

    @cached_property
    def ledger(self) -> Ledger:
        """Energy ledger of the whole run."""
        from tarsus.solve.series import ledger

        return ledger(self)

    def at(self, times: np.ndarray) -> Series:
        """Series at the given times [s], increasing: the engine's own solution, not an interpolation.

        Raises InputError where the times are not in order.
        """
        from tarsus.solve.series import sample

        return sample(self, increasing(times))

    def states(self, times: np.ndarray) -> Sampled:
        """States and contact forces alone at the given times [s], increasing: a fraction of the cost of `at`."""
        from tarsus.core.replay import sample

        return sample(self.plan.system, self.raw.book.book, self.raw.trace, increasing(times))

    def variables(self, times: np.ndarray | None = None) -> dict[str, Variable]:
        """The series as plain arrays by name; on an even grid unless ``times`` [s] are given."""
        from tarsus.solve.dataset import to_variables

        return to_variables(self, self.series if times is None else self.at(times))

    def to_dataset(self, times: np.ndarray | None = None) -> xarray.Dataset:
        """The run as an xarray Dataset, units as attributes; on an even grid unless ``times`` [s] are given."""
        from tarsus.files.series import dataset_of

        attrs = {"title": self.scene.name, "result": self.code.value}
        return dataset_of(
            self.variables(times), attrs | {"duration_s": self.duration, "period_s": self.period}
        )
