"""Everything that is said of a posterior: what is determined, what it predicts, what else one might have believed."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from fitting.left_out import EffectsLeftOut
from fitting.marginal import Marginal
from fitting.posterior.approximate import Approximate
from fitting.posterior.further_trial import FurtherTrials, further_trials
from fitting.posterior.identifiability import Identifiability, identifiability
from fitting.posterior.laplace import laplace
from fitting.posterior.naive import naive_posterior
from fitting.posterior.posterior import Posterior
from fitting.posterior.posterior_file import load_chains
from fitting.posterior.predictive import PredictedSweep, PredictedTrial, predict_sweep, predict_trials
from fitting.posterior.sampling import Progress
from fitting.posterior.shared import RobotPart, robot_parts
from fitting.posterior.whiteness import Whiteness
from fitting.sweep import sweep_frequencies
from fitting.trial import MeasuredTrial
from session import Flag
from session.records import KEPT_ELSEWHERE
from session.results import ResultFile
from swimmer import Twin

SWEPT = 9  # frequencies


@dataclass(frozen=True, eq=False)
class Findings:
    """What is said of a posterior.

    Attributes:
        marginals: of each coefficient, by name.
        chains: (w, d, 7) walkers, draws, coefficients and ln of the discrepancies of wave and speed.
        ess_bulk, r_hat: (7,).
        acceptance, autocorrelation, steps: of the ensemble; the autocorrelation in steps.
        simulations: of each trial.
        emulator_error: of ln likelihood at fresh draws, standard deviation.
        misfit_p: see `Posterior`.
        discrepancy: (2,) median relative error of the twin's wave and speed.
        robot: what it may be off by, before and after the swims.
        left_out: whether the trials ask for what the twin leaves out, and what that would do.
        identifiability, further, sweep, trials, whiteness: see there.
        laplace, naive: intervals by other ways.
        flags: when not to believe it.
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
    left_out: EffectsLeftOut
    identifiability: Identifiability
    further: FurtherTrials
    sweep: PredictedSweep
    trials: tuple[PredictedTrial, ...]
    whiteness: tuple[Whiteness, ...]
    laplace: Approximate
    naive: Approximate
    flags: tuple[Flag, ...]

    def inside(self, role: str) -> tuple[int, int, float]:
        """Trials of a role whose speed lies within its 90 % band, how many there are, and the share of harmonics."""
        chosen = [trial for trial in self.trials if trial.role == role]
        share = float(np.mean([trial.inside for trial in chosen])) if chosen else float("nan")
        return sum(trial.speed_inside for trial in chosen), len(chosen), share


FINDINGS = ResultFile("posterior.json", Findings)


def read_findings(results: Path) -> Findings:
    """Reads ``posterior.json``, and its draws from ``posterior.nc``.

    Raises:
        InputError: there is none of this version.
    """
    return FINDINGS.read(results, {"chains": load_chains(results / "posterior.nc")})


def find(
    posterior: Posterior,
    trials: Sequence[MeasuredTrial],
    twin: Twin,
    seed: int = 0,
    tell: Progress = lambda _message, _share: None,
    left_out: EffectsLeftOut = EffectsLeftOut(),  # noqa: B008 (it is frozen)
) -> Findings:
    """Works out all that is said of a posterior.

    Args:
        posterior: with its draws.
        trials: all swims, fit and held-out.
        twin: with their markers.
        seed: of all draws.
        tell: of the progress.
        left_out: what score tests of effects said.
    """
    draws = posterior.draws
    tell("comparing with other ways to intervals", 0.0)
    beside = {"laplace": laplace(posterior), "naive": naive_posterior(posterior, seed)}
    tell("predicting trials and the speed over frequency", 0.2)
    predicted = predict_trials(posterior, trials, twin, seed)
    sweep = predict_sweep(posterior, twin, sweep_frequencies([t.frequency.hz for t in trials], SWEPT), seed)
    tell("looking for the most telling further swim", 0.6)
    return Findings(
        marginals=posterior.marginals,
        chains=draws.chains,
        ess_bulk=draws.ess_bulk,
        r_hat=draws.r_hat,
        acceptance=draws.acceptance,
        autocorrelation=draws.autocorrelation,
        steps=draws.steps,
        simulations=posterior.found.simulations,
        emulator_error=posterior.found.emulator_error,
        misfit_p=posterior.misfit_p,
        discrepancy=np.median(posterior.discrepancy, axis=0),
        robot=robot_parts(posterior),
        left_out=left_out,
        identifiability=identifiability(posterior),
        further=further_trials(posterior, twin, seed),
        sweep=sweep,
        trials=predicted,
        whiteness=posterior.whiteness,
        flags=(*posterior.flags, *left_out.flags),
        **beside,
    )
