"""Summary of a posterior: what is determined, what it predicts, and whether to believe it.

`summarise` makes the record of `posterior.json`; `read_summary` reads it, with the draws of `posterior.nc` if they are
needed.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from fitting.baselines import sweep_frequencies
from fitting.coefficient_fit import Marginal
from fitting.forecast import scatter_of
from fitting.posterior.posterior import (
    Identifiability,
    Posterior,
    RobotPart,
    identifiability,
    load_chains,
    robot_flags,
    robot_parts,
)
from fitting.posterior.prediction import PredictedSweep, PredictedTrial, predict_sweep, predict_trials
from fitting.posterior.whiteness import Whiteness, noise_flags, whiteness
from fitting.progress import Progress, part_of
from fitting.session_forecast import DRAWN, ForecastTrial, SessionForecast, simple_rules
from fitting.trial import MeasuredTrial
from fitting.trial_checks import BEARING
from swimcal.flags import Flag
from swimcal.results import KEPT_ELSEWHERE, ResultFile

SWEPT = 7  # frequencies
_ALL = 0.985  # share of coordinates in 90 % bands that chance leaves in one trial of 20


@dataclass(frozen=True, eq=False)
class PosteriorSummary:
    """The content of `posterior.json`; the draws are in `posterior.nc`.

    Attributes:
        marginals: marginal posterior of each coefficient.
        chains: (w, d, 7) d steps of w walkers: coefficients and ln sizes of the discrepancies of wave and speed.
        ess_bulk, r_hat: (7,) effective number of draws, and convergence, of each of these.
        acceptance, autocorrelation, steps: share of accepted steps, autocorrelation time in steps, and number of steps.
        simulations: how often each trial was simulated.
        emulator_error: standard deviation of the error of the emulated ln likelihood, at fresh draws.
        misfit_p: probability of a larger misfit by noise and nuisances alone.
        discrepancy: (2,) median relative error of the twin's wave and speed.
        robot: standard deviation of each number of the robot before and after the swim trials.
        identifiability: which coefficients, and which combinations of them, the trials determine.
        sweep: predicted speed over frequency, with bands.
        trials: predicted and measured speed of every trial, with bands.
        forecasts: of every trial, averaged over the draws, and by simple baselines.
        whiteness: autocorrelation of the residuals of every trial.
        flags: flags of the posterior.
    """

    marginals: Mapping[str, Marginal]
    chains: np.ndarray = field(metadata=KEPT_ELSEWHERE)
    ess_bulk: np.ndarray
    r_hat: np.ndarray
    acceptance: float
    autocorrelation: float
    steps: int
    simulations: int
    emulator_error: float
    misfit_p: float
    discrepancy: np.ndarray
    robot: tuple[RobotPart, ...]
    identifiability: Identifiability
    sweep: PredictedSweep
    trials: tuple[PredictedTrial, ...]
    forecasts: SessionForecast
    whiteness: tuple[Whiteness, ...]
    flags: tuple[Flag, ...]

    def inside(self, role: str) -> tuple[int, int, float]:
        """Count the trials of a role whose speed lies within its 90 % band.

        Returns:
            Their number, the number of all trials of the role, and the share of coordinates within their bands.
        """
        chosen = [trial for trial in self.trials if trial.role == role]
        share = float(np.mean([trial.inside for trial in chosen])) if chosen else float("nan")
        return sum(trial.speed_inside for trial in chosen), len(chosen), share

    @property
    def wanted(self) -> np.ndarray:
        """Coefficients that a further trial is judged by, (5,): those that are not determined, or all."""
        determined = np.array([marginal.determined for marginal in self.marginals.values()])
        return ~determined if not determined.all() else np.ones(len(determined), bool)


SUMMARY = ResultFile("posterior.json", PosteriorSummary)


def read_summary(results: Path, draws: bool = True) -> PosteriorSummary:
    """Read ``posterior.json``, and its draws from ``posterior.nc`` unless they are not needed.

    Args:
        results: the folder of results.
        draws: whether the draws are needed.

    Raises:
        InputError: there is none of this version.
    """
    chains = load_chains(results / "posterior.nc") if draws else np.empty((0, 0, 7))
    return SUMMARY.read(results, {"chains": chains})


def summarise(
    posterior: Posterior,
    trials: Sequence[MeasuredTrial],
    seed: int = 0,
    tell: Progress = lambda _message, _share: None,
) -> PosteriorSummary:
    """Summarise a posterior.

    Args:
        posterior: the posterior.
        trials: all trials of the session.
        seed: seed of the predictions.
        tell: takes messages with the share of the work that is done.
    """
    draws, robot = posterior.draws, robot_parts(posterior)
    tell("predicting trials", 0.0)
    predicted = predict_trials(posterior, trials, seed)
    frequency_hz = sweep_frequencies([t.frequency.hz for t in trials], SWEPT)
    sweep = predict_sweep(posterior, frequency_hz, seed, part_of(tell, 0.35, 1.0))
    white = tuple(whiteness(trial) for trial in posterior.mode.model.trials)
    missed = [flag for trial in predicted for flag in trial.flags]
    return PosteriorSummary(
        marginals=posterior.marginals,
        chains=draws.chains,
        ess_bulk=draws.ess_bulk,
        r_hat=draws.r_hat,
        acceptance=draws.acceptance,
        autocorrelation=draws.autocorrelation,
        steps=draws.steps,
        simulations=posterior.surrogate.simulations,
        emulator_error=posterior.surrogate.error,
        misfit_p=posterior.misfit_p,
        discrepancy=np.median(posterior.discrepancy, axis=0),
        robot=robot,
        identifiability=identifiability(posterior),
        sweep=sweep,
        trials=predicted,
        forecasts=_forecasts(posterior, trials, predicted),
        whiteness=white,
        flags=(
            *_of_trials(trials),
            *posterior.flags,
            *missed,
            *_flag_wide(predicted),
            *noise_flags(white),
            *robot_flags(robot),
        ),
    )


def _flag_wide(predicted: Sequence[PredictedTrial]) -> tuple[Flag, ...]:
    """Flag bands that hold nearly everything: they are as wrong as bands that hold too little."""
    inside = [trial.inside for trial in predicted if np.isfinite(trial.inside)]
    if not inside or (share := float(np.median(inside))) < _ALL:
        return ()
    message = (
        f"the 90 % bands hold {100 * share:.1f} % of the marker coordinates of half the trials and more: they are "
        "wider than these trials need, by what the speed's discrepancy is believed to be beforehand"
    )
    return (Flag("wide_bands", message=message),)


def _of_trials(trials: Sequence[MeasuredTrial]) -> tuple[Flag, ...]:
    """Return the flags of fitted trials that bear on every coefficient, each with its trial's name."""
    fitted = [trial for trial in trials if trial.role == "fit"]
    return tuple(
        replace(flag, frames=None, message=f"{trial.name}: {flag.message}")
        for trial in fitted
        for flag in trial.flags
        if flag.kind in BEARING
    )


def _forecasts(
    posterior: Posterior, trials: Sequence[MeasuredTrial], predicted: Sequence[PredictedTrial]
) -> SessionForecast:
    fitted, found = [block.model.trial for block in posterior.mode.blocks], {}
    for trial, each in zip(trials, predicted, strict=True):
        held_out = trial.role != "fit"
        hz = (trial.start_frequency if held_out else trial.frequency).hz
        models = {DRAWN: each.forecast, **(simple_rules(fitted, hz) if held_out else {})}
        found[trial.name] = ForecastTrial(trial.role, hz, trial.speed, models)
    return SessionForecast(scatter_of(posterior.mode), found)
