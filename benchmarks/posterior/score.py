"""Simulation-based calibration of the posterior (Talts et al. 2018): do its intervals cover the truth?

Truths are drawn from the prior, sessions are made from them, and the posterior of each is sampled. The share
of draws below the truth is uniform when the posterior is right.
"""

import time
from dataclasses import dataclass

import numpy as np

from benchmarks.posterior.truth import draw_session
from fitting.posterior.posterior import MISFIT_P, sample_posterior
from fitting.search import find_mode
from fitting.session_model import SessionModel

EFFECTIVE = 100  # effective sample size asked for
STARTS = 3  # number of starts of the search for the mode
WARNINGS = (
    "model_discrepancy",
    "robot_off",
    "emulator_off",
    "not_converged",
    "noise_not_white",
    "fit_outside",
)
"""Flags by which a reader is warned not to trust the intervals."""
Five = tuple[float, ...]


@dataclass(frozen=True)
class PosteriorScore:
    """The posterior of one drawn session against its truth; fives are in the order of `FluidCoefficients`."""

    seed: int  # seed that the session was drawn with
    varied: bool  # whether its trials differ in trim, registration and speed
    truth: Five  # true coefficients
    below: Five  # share of all draws below the truth
    # q05, q95, mean, sd: quantiles, mean and standard deviation of the draws
    q05: Five
    q95: Five
    mean: Five
    sd: Five
    r_hat: Five  # R-hat of the draws
    misfit_p: float  # probability that noise and nuisances alone would misfit as much
    flags: tuple[str, ...]  # kinds of the flags
    seconds: float  # duration of fit and posterior, with whatever else ran
    gapped: bool = False  # whether markers were unseen for a while, or throughout

    @property
    def warnings(self) -> frozenset[str]:
        """Kinds of flags by which a reader is warned not to believe the intervals."""
        misfit = {"model_discrepancy"} if self.misfit_p < MISFIT_P else set()
        return frozenset(misfit | (set(WARNINGS) & set(self.flags)))

    @property
    def covered(self) -> np.ndarray:
        """(5,) whether the 90 % interval holds the truth."""
        truth = np.array(self.truth)
        return (np.array(self.q05) <= truth) & (truth <= np.array(self.q95))

    @property
    def off_sd(self) -> np.ndarray:
        """(5,) truth less posterior mean, in standard deviations."""
        return (np.array(self.truth) - np.array(self.mean)) / np.array(self.sd)


def score_session(seed: int) -> PosteriorScore:
    """Draw a session, sample its posterior and compare it with the truth, on one core.

    Args:
        seed: seed of the session and of the sampler; the trials of every other one vary, every third has gaps.
    """
    drawn = draw_session(seed, workers=1, varied=seed % 2 == 1, gapped=seed % 3 == 0)
    began = time.perf_counter()
    mode = find_mode(SessionModel.of(drawn.twin, drawn.trials, with_course=True), STARTS, seed)
    posterior = sample_posterior(mode, EFFECTIVE, seed)
    seconds = time.perf_counter() - began
    truth, draws = np.array(drawn.truth), posterior.coefficients
    q05, q95 = np.quantile(draws, [0.05, 0.95], axis=0)
    return PosteriorScore(
        seed=drawn.seed,
        varied=drawn.varied,
        gapped=drawn.gapped,
        truth=_pack_five(truth),
        below=_pack_five((draws < truth).mean(axis=0)),
        q05=_pack_five(q05),
        q95=_pack_five(q95),
        mean=_pack_five(draws.mean(axis=0)),
        sd=_pack_five(draws.std(axis=0, ddof=1)),
        r_hat=_pack_five(posterior.draws.r_hat[:5]),
        misfit_p=posterior.misfit_p,
        flags=tuple(flag.kind for flag in posterior.flags),
        seconds=seconds,
    )


def _pack_five(values: np.ndarray) -> Five:
    return tuple(float(value) for value in values)
