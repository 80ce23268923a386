"""Summary of a posterior: what is determined, what it predicts, and whether to believe it.

`summarise` makes the record of `posterior.json`; `read_summary` reads it, with the draws of `posterior.nc` if they are
needed.

Bands and posterior rest on the noise model, whose residual must be white. `whiteness` looks at a trial's residual in
time and between neighbouring markers. All samples of a trial are freed at once of what the noise model correlates, and
of a smooth swim. `noise_flags` says where the model falls short.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np
from scipy.linalg import solve_triangular
from scipy.stats import chi2

from fitting.baselines import sweep_frequencies
from fitting.coefficient_fit import Marginal
from fitting.forecast import scatter_of
from fitting.noise import beside
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
from fitting.progress import Progress, part_of
from fitting.session_forecast import DRAWN, ForecastTrial, SessionForecast, simple_rules
from fitting.trial import HARMONICS, MeasuredTrial
from fitting.trial_checks import BEARING
from fitting.trial_model import TrialModel
from swimcal.flags import Flag
from swimcal.results import KEPT_ELSEWHERE, ResultFile

# The test of the noise
_LAGS = 20  # largest number of lags
_ENOUGH = 40  # least frames in which a marker, or two neighbours, must be seen
_OUTSIDE = 0.2  # share of the lags that may lie outside their 95 % band
_BY_CHANCE = 0.99  # share of trials with white noise that stay below the limit of neighbours
_SAMPLES = 2400  # samples that are freed of correlation at once
_DIFFUSE = 1e10  # variance of each number of the smooth swim, against that of a sample
_DETERMINED = 1e3  # standard deviation of a forecast, against that of a sample, below which the swim is determined
_RATES = ("", ", up to the third harmonic")  # the two rows of correlations between neighbours, in words

SWEPT = 7  # frequencies
_ALL = 0.985  # share of coordinates in 90 % bands that chance leaves in one trial of 20


@dataclass(frozen=True, eq=False)
class Whiteness:
    """Correlation of the residuals of one trial's tracks about a smooth swim, before and after the noise model.

    Attributes:
        trial: name of the trial.
        lag_s: (l,) lags, from one frame on.
        raw: (l,) autocorrelation of the residuals.
        innovations: (l,) autocorrelation of what the model takes for independent.
        limit: bound within which 95 % of the lags of white noise lie.
        neighbours_raw: (2, m - 1) correlation between neighbours from nose to fin, of the residuals: of all rates, and
            of those no faster than the third harmonic of the beat, which features read.
        neighbours: (2, m - 1) the same correlation of what the model takes for independent.
        neighbours_limit: (2,) bound below which the root mean square of these lies in 99 % of trials with white noise.
        frames: number of frames.
        effective: number of independent frames that would determine a mean as well.
        white: share of the noise's variance that is white.
        lasts_s: time in which the correlation of the rest falls to 1/e.
        sd_m: (m,) standard deviation of each marker.
    """

    trial: str
    lag_s: np.ndarray
    raw: np.ndarray
    innovations: np.ndarray
    limit: float
    neighbours_raw: np.ndarray
    neighbours: np.ndarray
    neighbours_limit: np.ndarray
    frames: int
    effective: float
    white: float
    lasts_s: float
    sd_m: np.ndarray

    @property
    def outside(self) -> float:
        """Share of the lags that lie outside the limit."""
        return float((np.abs(self.innovations) > self.limit).mean())

    @property
    def neighbour_correlation(self) -> np.ndarray:
        """Root mean square of the correlations between neighbours after the model, (2,)."""
        return _rms(self.neighbours)

    @property
    def neighbour_correlation_raw(self) -> np.ndarray:
        """Root mean square of the correlations between neighbours before the model, (2,)."""
        return _rms(self.neighbours_raw)

    @property
    def in_time(self) -> bool:
        """Return whether at most a fifth of the lags lie outside the limit."""
        return self.outside <= _OUTSIDE

    @property
    def across(self) -> bool:
        """Return whether neighbours are no more correlated after the model than by chance."""
        return not (self.neighbour_correlation > self.neighbours_limit).any()

    @property
    def is_white(self) -> bool:
        """Return whether the residual is white in time and across markers."""
        return self.in_time and self.across

    @property
    def fault(self) -> str:
        """Description of what is not white after the model; an empty text where all is."""
        said = []
        if not self.in_time:
            said.append(
                f"{100 * self.outside:.0f} % of the lags lie outside the band of white noise, at most "
                f"{100 * _OUTSIDE:.0f} % may"
            )
        if not self.across:
            worst = int(np.argmax(self.neighbour_correlation / self.neighbours_limit))
            said.append(
                f"neighbouring markers correlate by {self.neighbour_correlation[worst]:.2f} (root mean square"
                f"{_RATES[worst]}), at most {self.neighbours_limit[worst]:.2f} is chance"
            )
        return " and ".join(said)


def noise_flags(found: Sequence[Whiteness]) -> list[Flag]:
    """Flag each trial whose noise is not as the model takes it to be."""
    return [
        Flag(
            "noise_not_white",
            message=f"{one.trial}: what the noise model leaves of the tracks is not white: {one.fault}; "
            "intervals may be too narrow or too wide",
        )
        for one in found
        if not one.is_white
    ]


def whiteness(model: TrialModel) -> Whiteness:
    """Test the noise of one trial's tracks; of a long trial, that of its beginning."""
    reader, noise, columns = model.reader, model.noise, beside(model.reader)
    seen = reader.usable.sum(axis=0) >= max(_ENOUGH, 2 * columns.shape[1])
    along_m = model.twin.robot.marker_positions_m(model.trial.markers)[:, 0]
    order = np.array([m for m in np.argsort(along_m) if seen[m]], int)
    usable = reader.usable[: _SAMPLES // max(len(order), 1), order]
    scaled = model.trial.position_m[model.trial.kept][: len(usable), order] / noise.sd_m[order, None]
    both = _beside_swim(columns[: len(usable)], scaled, usable), _innovations(columns, scaled, usable, model, order)
    time_s = reader.time_s[: len(usable)]
    lags = range(1, min(_LAGS, len(usable) // 4) + 1)
    raw, innovations = (
        np.array([_correlation(each[:-lag].reshape(-1, 2), each[lag:].reshape(-1, 2)) for lag in lags]) for each in both
    )
    fastest_hz = HARMONICS * np.ptp(reader.turn_rad) / (2 * np.pi * np.ptp(reader.time_s))
    slow = np.exp(-0.5 * (2 * np.pi * fastest_hz * (time_s[:, None] - time_s)) ** 2)
    weights = np.eye(len(time_s)), slow
    pairs = [m for m in range(len(order) - 1) if usable[:, m : m + 2].all(axis=1).sum() >= _ENOUGH]
    neighbours_raw, neighbours = (
        np.array([[_correlation(each[:, m], each[:, m + 1], weight) for m in pairs] for weight in weights])
        for each in both
    )
    chance = np.array([sum(_chance(both[1][:, m : m + 2], weight) for m in pairs) for weight in weights])
    count = max(len(pairs), 1)
    return Whiteness(
        trial=model.trial.name,
        lag_s=float(np.median(np.diff(reader.time_s))) * np.array(lags),
        raw=raw,
        innovations=innovations,
        limit=1.96 / np.sqrt(max(np.isfinite(both[1]).sum(), 1)),
        neighbours_raw=neighbours_raw,
        neighbours=neighbours,
        neighbours_limit=np.sqrt(chi2.ppf(_BY_CHANCE, count) * chance) / count,
        frames=len(reader.time_s),
        effective=noise.effective,
        white=noise.white,
        lasts_s=noise.lasts_s,
        sd_m=noise.sd_m,
    )


def _beside_swim(columns: np.ndarray, scaled: np.ndarray, usable: np.ndarray) -> np.ndarray:
    """Return the residuals (n, m, 2) about a smooth swim, by least squares; nan where a sample does not count."""
    found = np.full(scaled.shape, np.nan)
    for m, own in enumerate(usable.T):
        found[own, m] = scaled[own, m] - columns[own] @ np.linalg.lstsq(columns[own], scaled[own, m], rcond=None)[0]
    return found


def _innovations(
    columns: np.ndarray, scaled: np.ndarray, usable: np.ndarray, model: TrialModel, order: np.ndarray
) -> np.ndarray:
    """Return the innovations (n, m, 2): each sample less its forecast by all before it, over the forecast's sd.

    The smooth swim has a diffuse prior: innovations are independent, but for the first ones, which determine it. Those
    are nan, as samples are that do not count (recursive residuals; Brown, Durbin and Evans 1975).
    """
    noise, time_s = model.noise, model.reader.time_s
    frame, place = np.nonzero(usable)
    own, rows, markers = place[:, None] == place, np.ix_(frame, frame), np.ix_(order[place], order[place])
    covariance = np.where(own, noise.correlation[rows] + _DIFFUSE * (columns @ columns.T)[rows], 0.0)
    for part in noise.parts:
        covariance += np.where(own, 0.0, part.across[markers] * part.over(time_s)[rows])
    root = np.linalg.cholesky(covariance)
    found = np.full(scaled.shape, np.nan)
    known = np.diag(root) < _DETERMINED
    found[frame[known], place[known]] = solve_triangular(root, scaled[frame, place], lower=True)[known]
    return found


def _correlation(first: np.ndarray, second: np.ndarray, weight: np.ndarray | None = None) -> float:
    """Return the correlation of two series (n, 2) where both count.

    With weights (n, n) it is over products of all pairs, else of each sample with its own.
    """
    counts = np.isfinite(first).all(axis=1) & np.isfinite(second).all(axis=1)
    a, b = first[counts], second[counts]
    left, right = (a, b) if weight is None else (weight[np.ix_(counts, counts)] @ each for each in (a, b))
    return float((left * b).sum() / np.sqrt((left * a).sum() * (right * b).sum()))


def _chance(pair: np.ndarray, weight: np.ndarray) -> float:
    """Return the variance of such a correlation between two markers' white noise (n, 2, 2)."""
    counts = np.isfinite(pair).all(axis=(1, 2))
    own = weight[np.ix_(counts, counts)]
    return float((own**2).sum() / (2 * np.trace(own) ** 2))


def _rms(correlations: np.ndarray) -> np.ndarray:
    return np.asarray(np.sqrt((correlations**2).sum(axis=1) / max(correlations.shape[1], 1)))


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
    sweep = predict_sweep(posterior, frequency_hz, seed, part_of(tell, 0.2, 1.0))
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
