"""Posteriors: by weighing draws of a prior, or by walkers (emcee, the optional extra ``posterior``)."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tarsus.base.errors import InputError
from tarsus.fit.verdict import LEVEL
from tarsus.identify.correlation import Ties
from tarsus.identify.prior import LogNormalPrior
from tarsus.identify.profile import LogLikelihood
from tarsus.identify.verdict import Assessment, judge_samples

__all__ = ["Drawn", "Posterior", "Weighed", "sample_posterior", "weigh_prior"]

Floats = NDArray[np.float64]

_SETTLED = 50.0
_FEWEST = 20.0


@dataclass(frozen=True)
class Drawn:
    """Draws of np parameters given data and what was believed before: paths; samples (ns, np), SI."""

    paths: tuple[str, ...]
    samples: Floats

    def judge(
        self,
        *,
        ties: Ties | None = None,
        limits: Mapping[str, tuple[float, float]] | None = None,
        level: float = LEVEL,
    ) -> Assessment:
        """Ranges, correlations and verdicts of the draws (see `judge_samples`)."""
        middle = np.median(self.samples, axis=0)
        return judge_samples(self.paths, middle, self.samples, ties=ties, limits=limits, level=level)

    def as_prior(self) -> LogNormalPrior:
        """The draws as a normal distribution of the logarithms, for ranking what to measure next."""
        return LogNormalPrior.of_samples(self.paths, self.samples)

    def belief(self) -> LogNormalPrior:
        """The former name of `as_prior`."""
        warnings.warn("belief() is now as_prior()", DeprecationWarning, stacklevel=2)
        return self.as_prior()


@dataclass(frozen=True)
class Posterior(Drawn):
    """Draws of an ensemble of walkers, transients dropped.

    log_probability (ns,), up to a constant; acceptance: share of the steps that were taken (0.2 to 0.5 is usual);
    autocorrelation (np,): steps after which a walker has forgotten where it was; steps: kept, of each walker.
    """

    log_probability: Floats
    acceptance: float
    autocorrelation: Floats
    steps: int

    @property
    def settled(self) -> bool:
        """Whether the walkers went on for 50 autocorrelation times, emcee's rule for trusting their draws."""
        return bool(self.steps >= _SETTLED * np.nanmax(self.autocorrelation))


@dataclass(frozen=True)
class Weighed(Drawn):
    """Draws of a prior, drawn again by how likely they make the data; effective: how many of them are left."""

    effective: float


def weigh_prior(
    likelihood: LogLikelihood,
    prior: LogNormalPrior,
    *,
    proposal: LogNormalPrior | None = None,
    draws: int = 1024,
    seed: int = 0,
) -> Weighed:
    """Weigh draws of a prior by a likelihood: one call of it, enough where the data do not narrow much.

    Parameters
    ----------
    likelihood
        Of parameters (n, np) in SI; -inf where they are impossible.
    prior
        What is known without these data.
    proposal
        Where to draw instead of the prior, such as what part of the data left of it; of the same paths, and rather
        wider than the answer. The weights make up for it.
    draws
        How many; as many are drawn again (Kitagawa's stratified resampling).
    seed
        Of the draws.

    Raises
    ------
    InputError
        If fewer than 20 draws are left in effect: take more, or `sample_posterior`; or if the proposal is of other
        paths than the prior.
    """
    source = proposal or prior
    if source.paths != prior.paths:
        raise InputError(
            f"the proposal is of {', '.join(source.paths)}, the prior of {', '.join(prior.paths)}"
        )
    rows = source.values * np.exp(source.draws(draws, seed))
    values = np.asarray(likelihood(rows), dtype=float)
    if proposal is not None:
        values = values + prior.log_density(rows) - proposal.log_density(rows)
    known = np.isfinite(values)
    weights = np.zeros(draws)
    weights[known] = np.exp(values[known] - np.max(values[known], initial=-np.inf))
    effective = float(weights.sum() ** 2 / np.sum(weights**2)) if weights.any() else 0.0
    if effective < _FEWEST:
        raise InputError(
            f"{effective:.0f} of {draws} draws of the prior are left by these data, too few to judge by: take more "
            "draws, or walkers (sample_posterior)"
        )
    places = (np.arange(draws) + np.random.default_rng(seed).random(draws)) / draws
    chosen = np.searchsorted(np.cumsum(weights) / weights.sum(), places)
    return Weighed(prior.paths, rows[np.minimum(chosen, draws - 1)], effective)


def sample_posterior(
    likelihood: LogLikelihood,
    prior: LogNormalPrior,
    *,
    walkers: int | None = None,
    steps: int = 1000,
    seed: int = 0,
    progress: Callable[[int, int, str], None] | None = None,
) -> Posterior:
    """Draw parameters from ``prior * likelihood`` by the affine-invariant ensemble of Goodman and Weare (2010).

    Walkers begin at the most probable of many draws of the prior. Half of them move at a time, and the likelihood gets
    all of these at once, so that a batched simulation serves them. Steps are dropped as transient for five
    autocorrelation times, at least a fifth of all and at most half.

    Parameters
    ----------
    likelihood
        Of parameters (n, np) in SI, such as `FeatureLikelihood`; -inf where they are impossible.
    prior
        What is known without these data; wide, where nothing is.
    walkers
        How many; four a parameter by default, at least 16. Even, and at least two a parameter.
    steps
        Of each walker.
    seed
        The same seed gives the same draws.
    progress
        Called as ``progress(done, total, what)``.

    Raises
    ------
    InputError
        If emcee is not installed, for numbers of walkers and steps that cannot be used, or when the likelihood of too
        few draws of the prior is finite.
    """
    emcee = _emcee()
    count = len(prior.paths)
    many = max(16, 4 * count) if walkers is None else walkers
    problems = []
    if many % 2 or many < 2 * count:
        problems.append(f"walkers: expected an even number of at least {2 * count}, got {many}")
    if steps < 20:
        problems.append(f"steps: expected at least 20, got {steps}")
    if problems:
        raise InputError(problems)
    precision = np.linalg.inv(prior.covariance)

    def log_probability(u: Floats) -> Floats:
        rows = np.atleast_2d(u)
        values = np.asarray(likelihood(prior.values * np.exp(rows)), dtype=float)
        values = np.where(np.isfinite(values), values, -np.inf)
        return values - 0.5 * np.einsum("ni,ij,nj->n", rows, precision, rows)

    drawn = prior.draws(8 * many, seed)
    chances = log_probability(drawn)
    known = np.flatnonzero(np.isfinite(chances))
    if len(known) < many:
        raise InputError(
            f"the likelihood of {len(known)} of {len(drawn)} draws of the prior is finite, and {many} walkers "
            "need as many to begin at: give a prior nearer to the data"
        )
    start = drawn[known[np.argsort(-chances[known], kind="stable")[:many]]]
    sampler = emcee.EnsembleSampler(many, count, log_probability, vectorize=True)
    sampler.random_state = np.random.RandomState(seed).get_state()
    for k, _ in enumerate(sampler.sample(start, iterations=steps, skip_initial_state_check=True)):
        if progress is not None:
            progress(k + 1, steps, "steps of the walkers")
    times = np.asarray(sampler.get_autocorr_time(tol=0, quiet=True))
    longest = float(np.nanmax(times)) if np.isfinite(times).any() else np.inf
    dropped = int(np.clip(5.0 * longest, steps // 5, steps // 2))
    samples = prior.values * np.exp(sampler.get_chain(discard=dropped, flat=True))
    return Posterior(
        prior.paths, samples, sampler.get_log_prob(discard=dropped, flat=True),
        float(np.mean(sampler.acceptance_fraction)), np.where(np.isfinite(times), times, np.inf), steps - dropped,
    )  # fmt: skip


def _emcee() -> Any:
    try:
        import emcee
    except ImportError:
        raise InputError(
            "a posterior needs emcee, which is not installed: pip install 'tarsus[posterior]'; ranges by bootstrap and "
            "by profile likelihood need nothing more"
        ) from None
    return emcee
