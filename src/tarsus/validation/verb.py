"""`tarsus validate` in Python: published experiments against what is computed of them."""

from __future__ import annotations

import os
from typing import overload

from tarsus.base.progress import Progress
from tarsus.base.progress import silent as nobody
from tarsus.base.verb import verb
from tarsus.validation.experiment import PublishedExperiment, experiment_names, load_experiment
from tarsus.validation.result import Suite, Validation
from tarsus.validation.running import compare_rows
from tarsus.validation.selection import Selection
from tarsus.validation.verdict import judged


@overload
def validate(
    name: str | os.PathLike[str], *, threads: int | None = None, progress: Progress | None = None
) -> Validation: ...
@overload
def validate(name: None = None, *, threads: int | None = None, progress: Progress | None = None) -> Suite: ...
@verb
def validate(
    name: str | os.PathLike[str] | None = None, *, threads: int | None = None, progress: Progress | None = None
) -> Validation | Suite:
    """Simulate every row of a published experiment, and judge the claims that were written about them.

    Parameters
    ----------
    name
        A packaged experiment (`tarsus.validation.experiment_names`), or a folder with ``device.toml``,
        ``measured.csv``, ``study.py``, ``claims.toml`` and ``notes.md``. All packaged ones when left out.
    threads
        Worker threads; by default one for each processor that this process may use.
    progress
        Called as ``progress(done, total, what)``.

    Returns
    -------
    Validation or Suite
        Every measured number with the computed one [SI], and the verdicts; of several experiments a `Suite`.

    Raises
    ------
    InputError
        For an unknown name, and with every problem of the folder's files.

    Examples
    --------
    >>> import tarsus as ts
    >>> found = ts.validate("ball-drop")
    >>> found.ok, [(one.name, one.outcome.value) for one in found.verdicts][-1]
    (True, ('time_to_rest', 'fails, as known'))
    """
    if name is not None:
        return _validation(load_experiment(name), threads, progress or nobody)
    known = {one: load_experiment(one) for one in experiment_names()}
    return Suite({one: _validation(found, threads, progress or nobody) for one, found in known.items()})


def _validation(one: PublishedExperiment, threads: int | None, progress: Progress) -> Validation:
    compared = tuple(compare_rows(one, threads, progress))
    verdicts = []
    for name, claim in one.claims.claims.items():
        column, chosen = one.claims.column_of(claim), Selection(claim.rows)
        own = [row for row in compared if row.column == column and chosen(row.row)]
        verdicts.append(judged(name, claim, column, one.claims.measured[column], own))
    return Validation(one, compared, tuple(verdicts))
