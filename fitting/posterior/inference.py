"""From trials to the posterior of the five coefficients, and when not to believe it."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
from scipy.stats import chi2
from threadpoolctl import threadpool_limits

from fitting.coefficient_fit import NAMES
from fitting.model.robot_doubt import Doubt
from fitting.model.session_model import SessionModel
from fitting.posterior.exploration import Exploration, explore
from fitting.posterior.likelihood import MOST_SPEED
from fitting.posterior.posterior import Posterior
from fitting.posterior.sampling import Draws, Progress, sample
from fitting.posterior.shared import robot_flags
from fitting.posterior.whiteness import noise_flags, whiteness
from fitting.trial import MeasuredTrial
from session import Flag
from swimmer import Twin

EFFECTIVE = 400
MISFIT_P = 0.01  # below which noise and nuisances alone do not explain a misfit
_MARKERS_OFF_M = 0.005  # from which where markers sit is worth a flag
_DISCREPANT = 0.02  # relative, from which the twin's own error is worth a flag
_PRESSES = 0.8  # of the most that is allowed, from which that limit decides


def sample_posterior(
    trials: list[MeasuredTrial],
    twin: Twin,
    start: np.ndarray | None = None,
    effective: int = EFFECTIVE,
    seed: int = 0,
    backend: Path | None = None,
    tell: Progress | None = None,
    doubts: Sequence[Doubt] | None = None,
) -> Posterior:
    """Finds the posterior of the coefficients given some trials, and draws from it.

    The prior is uniform over [0, 10] in each coefficient.

    Args:
        trials: to rest on, usually the fit trials.
        twin: with their markers.
        start: (s, 5) coefficients to look at as well, such as those of a fit.
        effective: draws wanted for every coefficient.
        seed: of all draws.
        backend: an HDF5 file that keeps every step of the sampler, and beside it one of the search (.npz) that keeps
            every round; both go on from there.
        tell: of the progress.
        doubts: of the robot; None where nobody measured its hinges and crank.
    """
    model = SessionModel.of(twin, trials, doubts)
    with threadpool_limits(1):  # the matrices are small: threads cost more than they save
        found = explore(model, start, seed, tell, None if backend is None else backend.with_suffix(".npz"))
        draws = sample(found, effective, seed, backend, tell)
        misfit_p = _misfit_p(model, found, draws)
        white = tuple(whiteness(trial) for trial in model.trials)
    result = Posterior(model, found, draws, misfit_p, white, ())
    return replace(result, flags=(*draws.flags, *_flags(result), *noise_flags(white), *robot_flags(result)))


def _misfit_p(model: SessionModel, found: Exploration, draws: Draws) -> float:
    """Of the squared deviation from the emulator at the posterior median, without any discrepancy."""
    middle = np.median(draws.flat[:, :5], axis=0)[None]
    left = found.likelihood.emulator(middle)[0] - model.measured
    squares = float(left @ np.linalg.solve(found.likelihood.known, left))
    return float(chi2.sf(squares, len(left) - len(NAMES)))


def _flags(posterior: Posterior) -> list[Flag]:
    flags, found = [], posterior.found
    if not found.settled:
        message = (
            f"the stand-in for the twin still misses its likelihood by {found.emulator_error:.1f} (standard deviation) "
            f"after {found.simulations} simulations of each trial: intervals may be off"
        )
        flags.append(Flag("emulator_off", message=message))
    wave, speed = np.median(posterior.discrepancy, axis=0)
    if max(wave, speed) > _DISCREPANT:
        message = (
            f"the twin's wave is off by {100 * wave:.0f} % and its speed by {100 * speed:.0f} % beyond noise and "
            "nuisances: the intervals allow for errors that change from trial to trial, not for those that all share"
        )
        if speed > _PRESSES * MOST_SPEED:
            message += (
                f"; {100 * MOST_SPEED:.0f} % is the most that its speed may be off by, so what is said of the "
                "coefficients holds of twins that must come that near"
            )
        flags.append(Flag("model_discrepancy", message=message))
    elif posterior.misfit_p < MISFIT_P:
        message = (
            f"noise and nuisances alone hardly put gaits as far from the twin (p {posterior.misfit_p:.2g}): "
            "something that the twin leaves out moves them, and coefficients may be off by more than their intervals"
        )
        flags.append(Flag("model_discrepancy", message=message))
    if found.off.marker_m > _MARKERS_OFF_M:
        message = (
            f"markers sit some {1000 * found.off.marker_m:.0f} mm from where the robot's description has them, in all "
            "trials alike: measure their places, for on nose and neck hangs the scale, and with it every speed"
        )
        flags.append(Flag("markers_off", message=message))
    for name, marginal in posterior.marginals.items():
        interval = f"90 % interval {marginal.q05:.2g} to {marginal.q95:.2g}"
        if at := marginal.at_bounds:
            bounds = " and ".join(f"{bound:g}" for bound in at)
            message = f"{name} presses against its bound {bounds}, which is not the trials' doing: {interval}"
            flags.append(Flag("at_bound", message=message))
        if not marginal.narrow:
            flags.append(Flag("unidentifiable", message=f"{name} is not determined: {interval}"))
    return flags
