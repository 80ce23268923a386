"""Covariance of a session's features: variance components with priors, found by restricted maximum likelihood.

The effect of a component of unit size on the features of all trials is a matrix; the `Covariance` is their sum, each
times the square of its standard deviation (a linear mixed model; Patterson and Thompson 1971; Pinheiro and Bates 2000).
Lognormal priors (`COMPONENTS`) let two trials suffice: where these say nothing of a component, it keeps its prior
median.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Literal, NamedTuple

import numpy as np
from scipy.linalg import block_diag, cho_factor, cho_solve
from scipy.linalg.lapack import dpotri
from scipy.optimize import minimize

from fitting.features import (
    COURSE,
    SPEED,
    advance_phase,
    beat_phase,
    harmonics_of,
    marker_part,
    marker_slice,
    places_of_slides,
)
from fitting.picture_scale import HEAD_BOX_M, box_columns, head_marker_columns
from fitting.trial import HARMONICS
from fitting.trial_model import Sensitivities, TrialModel
from swimcal.mjcf import COEFFICIENT_BOUNDS

_LENGTH_M = 0.12  # length scale of discrepancies along the body
_OF_ITS_OWN = 0.2  # share of a discrepancy's variance that each marker has to itself
_OF_HARMONIC = 0.5  # discrepancy of each harmonic over that of the one before
LN_LENGTH = 0.7
"""Length scale of the common discrepancy of the wave in the logarithm of frequency: a factor of two."""
COEFFICIENT_SD = (COEFFICIENT_BOUNDS[1] - COEFFICIENT_BOUNDS[0]) / np.sqrt(12.0)
"""Standard deviation of a coefficient that is uniform between its bounds; the only prior that it has."""
_SLOPE = 3.0  # slope of the line: an error of a tenth in the middle goes with one of a third in the exponent
_ITERATIONS = 60  # largest number of iterations of the search for the components
_FARTHEST = 5.0
"""Largest distance of a component from its median, in prior standard deviations.

Otherwise a first step that is far too long makes one of them so large that rounding alone makes the sum indefinite.
"""
FORECAST_SPEED = 0.10
"""Size of `speed_common` in forecasts, which must not assume that the twin swims as fast (a cut; Liu, Bayarri and
Berger 2009). Its line then allows for a power of a third, as laminar and turbulent drag differ (Gazzola et al. 2014).
"""


class Component(NamedTuple):
    """Variance component with the prior of its standard deviation.

    Attributes:
        name: name of the component.
        level: whether each trial has a draw of its own, or all share one.
        unit: unit of the standard deviation; "1" for a share.
        median, ln_sd: parameters of the lognormal prior.
        meaning: what varies, in words.
    """

    name: str
    level: Literal["trial", "session"]
    unit: str
    median: float
    ln_sd: float
    meaning: str


COMPONENTS = (
    Component("box_placement", "trial", "m", 0.003, 0.7, "distance of a box from its marker, but of nose and neck"),
    Component("head_registration", "trial", "rad", 0.02, 0.7, "the head frame turned against the body"),
    Component("sideways_drift", "trial", "m/s", 0.005, 1.0, "trim: a steady slip to one side"),
    Component("turning", "trial", "rad/s", 0.03, 1.0, "trim: a steady turn"),
    Component("marker_drift", "trial", "m/s", 0.001, 1.5, "a marker sliding along the body"),
    Component("marker_placement", "session", "m", 0.003, 0.7, "a marker beside its described place, but nose and neck"),
    Component("wave_common", "session", "1", 0.05, 1.5, "discrepancy of the body wave, correlated over frequency"),
    Component("wave_own", "trial", "1", 0.03, 1.5, "discrepancy of the body wave of one trial"),
    Component("speed_common", "session", "1", 0.03, 0.2, "discrepancy of the speed, a line in frequency"),
    Component("speed_own", "trial", "1", 0.02, 0.2, "discrepancy of the speed of one trial"),
)
"""All variance components.

The last two are nearly fixed: two speeds determine no variance, and a calibrated twin should swim as fast. A smaller
`speed_common` brings the exported twin nearer to its trials, but corrected forecasts of the public trials get worse.
"""


class Block(NamedTuple):
    """Features of one window of a trial, k numbers.

    Attributes:
        model: the window with the twin; its features hold the course.
        sensitivities: sensitivities to its nuisances, by their standard deviations.
        noise: (k, k) of the tracks.
        time_step: (k,) what simulated features lack against a vanishing time step.
        trial: number of its trial: windows of one trial share all that is the trial's own.
        features: (k,) that nuisances and discrepancies refer to: measured of a fitted trial, simulated of a new one, so
            that nothing of what is scored enters a forecast.
    """

    model: TrialModel
    sensitivities: Sensitivities
    noise: np.ndarray
    time_step: np.ndarray
    trial: int
    features: np.ndarray

    @property
    def is_finite(self) -> bool:
        """Return whether no twin next to it diverges."""
        return all(np.isfinite(part).all() for part in (*self.sensitivities, self.time_step))


@dataclass(frozen=True, eq=False)
class Covariance:
    """Covariance of the features of several windows, stacked into one row of length K.

    A number that is not observed is 0 in measured and simulated features. Here it has a variance of its own and nothing
    in common with any other, so that all that is made from this covariance is as if its row were not there.

    Attributes:
        known: (K, K) of tracking noise, and of nuisances whose size is known.
        rolls: (K, 2) effect of the hull's roll, by the standard deviations of its two numbers.
        units: by the component's name, (K, K) of unit size.
    """

    known: np.ndarray
    rolls: np.ndarray
    units: Mapping[str, np.ndarray]

    @classmethod
    def of(cls, blocks: Sequence[Block], fitted: Sequence[Block] | None = None) -> "Covariance":
        """Build the covariance from the sensitivities of each window.

        Args:
            blocks: the windows to stack.
            fitted: windows whose mean frequency centres the line of the speed's discrepancy; by default all.
        """
        whose = np.array([block.trial for block in blocks])
        length = len(blocks[0].features)
        same = np.kron(np.equal.outer(whose, whose), np.ones((length, length)))

        def own(columns: Sequence[np.ndarray]) -> np.ndarray:
            """Return the covariance of a draw of each trial's own, the same in all of its windows."""
            stacked = np.vstack(columns)
            return (stacked @ stacked.T) * same

        def common(columns: Sequence[np.ndarray]) -> np.ndarray:
            stacked = np.vstack(columns)
            return stacked @ stacked.T

        sensitivities = [block.sensitivities for block in blocks]
        head = blocks[0].model.places_of_head
        waves = _wave_roots(blocks)
        of_course = [_unit_columns(length, places) for places in _course_places(length)]
        noise = block_diag(*[block.noise for block in blocks])
        ln_hz = np.log([block.model.trial.frequency.hz for block in blocks])
        nearness = np.exp(-0.5 * (np.subtract.outer(ln_hz, ln_hz) / LN_LENGTH) ** 2)  # (b, b)
        count = len(blocks)
        units = {
            "box_placement": own([np.delete(each.boxes, head, axis=1) for each in sensitivities]),
            "head_registration": own([_turn_slope(block.features)[:, None] for block in blocks]),
            "sideways_drift": own([of_course[0]] * count),
            "turning": own([of_course[1]] * count),
            "marker_drift": own([of_course[2]] * count),
            "marker_placement": common([np.delete(each.markers, head, axis=1) for each in sensitivities]),
            "wave_common": common(waves) * np.kron(nearness, np.ones((length, length))),
            "wave_own": own(waves),
            "speed_common": common(_lines(blocks, fitted or blocks)),
            "speed_own": own([block.features[SPEED] * _unit_columns(length, [SPEED]) for block in blocks]),
        }
        known = noise + own([each.own for each in sensitivities]) + common([each.robot for each in sensitivities])
        known += common([block.time_step[:, None] for block in blocks])
        windows = [block.model for block in blocks]
        boxes = HEAD_BOX_M * box_columns(windows, sensitivities, [block.trial for block in blocks], only_head=True)
        known += boxes @ boxes.T
        known += common(list(map(head_marker_columns, windows, sensitivities)))
        observed = np.concatenate([block.model.reader.observed for block in blocks])
        return cls(
            apart(known, observed),
            np.vstack([each.rolls for each in sensitivities]),
            {name: apart(unit, observed, 0.0) for name, unit in units.items()},
        )

    @property
    def fixed(self) -> np.ndarray:
        """Covariance (K, K) of all but the components: noise, nuisances of known size, and the roll."""
        return self.known + self.rolls @ self.rolls.T

    def without_roll(self, sizes: Mapping[str, float]) -> np.ndarray:
        """Return the covariance (K, K) with components of these standard deviations, without the roll."""
        return self.known + np.asarray(sum(sizes[name] ** 2 * unit for name, unit in self.units.items()))

    def at(self, sizes: Mapping[str, float]) -> np.ndarray:
        """Return the covariance (K, K) with components of these standard deviations."""
        return self.without_roll(sizes) + self.rolls @ self.rolls.T

    def restricted(
        self, residual: np.ndarray, jacobian: np.ndarray, start: Mapping[str, float]
    ) -> tuple[dict[str, float], float]:
        """Return the likeliest standard deviations, and -ln of their posterior density, coefficients integrated out.

        Args:
            residual: (K,) measured less simulated features.
            jacobian: (K, 5) of the simulated features.
            start: standard deviations to begin with.
        """
        free = self.fixed + COEFFICIENT_SD**2 * jacobian @ jacobian.T
        names = [component.name for component in COMPONENTS]
        units, mean, sd = [self.units[name] for name in names], _LN_MEDIAN, _LN_SD

        def deviance(ln_sizes: np.ndarray) -> tuple[float, np.ndarray]:
            shares = np.exp(2 * ln_sizes)
            total = free + np.asarray(sum(share * unit for share, unit in zip(shares, units, strict=True)))
            factor = cho_factor(total, lower=True)
            pull = cho_solve(factor, residual)
            off = (ln_sizes - mean) / sd
            value = 0.5 * residual @ pull + np.log(np.diag(factor[0])).sum() + 0.5 * off @ off
            inner = inverse_of(factor[0]) - np.outer(pull, pull)
            slope = np.array([share * np.vdot(inner, unit) for share, unit in zip(shares, units, strict=True)])
            return float(value), slope + off / sd

        begin = np.log([start[name] for name in names])
        options = {"maxiter": _ITERATIONS, "ftol": 1e-6}
        within = list(zip(mean - _FARTHEST * sd, mean + _FARTHEST * sd, strict=True))
        found = minimize(deviance, begin, jac=True, method="L-BFGS-B", bounds=within, options=options)
        return dict(zip(names, map(float, np.exp(found.x)), strict=True)), float(found.fun)


def inverse_of(root: np.ndarray) -> np.ndarray:
    """Return the inverse (k, k) of a covariance, from its lower Cholesky factor (k, k)."""
    half = np.tril(dpotri(root, lower=True)[0])
    return np.asarray(half + half.T - np.diag(np.diag(half)))


def apart(covariance: np.ndarray, observed: np.ndarray, variance: float = 1e-6) -> np.ndarray:
    """Return a covariance (k, k) in which unobserved numbers have no correlation.

    Args:
        covariance: (k, k).
        observed: (k,) whether each number is observed.
        variance: variance of the unobserved ones.
    """
    return np.where(np.outer(observed, observed), covariance, np.diag(np.where(observed, 0.0, variance)))


def wave_discrepancy(measured: np.ndarray, position_m: np.ndarray) -> np.ndarray:
    """Return the covariance (k, k) of a wave that is off by 100 %.

    The first harmonic of each marker is off by its own size, higher ones by half of the one before, correlated between
    neighbours along the body. Means do not count: they are those of the boxes.

    Args:
        measured: (k,) features of m markers.
        position_m: (m,) places of the markers along the body.
    """
    first = np.sqrt((np.abs(harmonics_of(measured)[..., 0]) ** 2).sum(axis=-1) / 2)  # (m,)
    size = np.maximum(first, 0.1 * first.max())
    of_column = np.append(0.0, harmonic_decay()) ** 2  # (7,)
    total = np.zeros((len(measured),) * 2)
    total[1:, 1:] = np.kron(np.outer(size, size) * along_body(position_m), np.diag(np.tile(of_column, 2)))
    return total


def along_body(position_m: np.ndarray) -> np.ndarray:
    """Return the correlation (m, m) of displacements of markers at (m,) along the body.

    Each marker has a share of its own.
    """
    smooth = np.exp(-0.5 * ((position_m[:, None] - position_m) / _LENGTH_M) ** 2)
    return np.asarray((1 - _OF_ITS_OWN) * smooth + _OF_ITS_OWN * np.eye(len(position_m)))


def harmonic_decay() -> np.ndarray:
    """Return the size (6,) of cosine and sine of each harmonic of a displacement, against the first."""
    return np.repeat(_OF_HARMONIC ** np.arange(HARMONICS), 2)


_LN_MEDIAN = np.log([component.median for component in COMPONENTS])
_LN_SD = np.array([component.ln_sd for component in COMPONENTS])
MEDIANS: Mapping[str, float] = {component.name: component.median for component in COMPONENTS}
"""Prior medians of the standard deviations."""


def _course_places(length: int) -> tuple[Sequence[int], ...]:
    """Return the places of the sideways speed, the turning, and the markers' drift in features of k numbers."""
    slides = places_of_slides(length)
    sideways = length - len(COURSE)
    return [sideways], [sideways + 1], list(range(slides.start, slides.stop))


def _unit_columns(length: int, places: Sequence[int]) -> np.ndarray:
    return np.eye(length)[:, list(places)]


def _turn_slope(features: np.ndarray) -> np.ndarray:
    """Return the derivative (k,) of features by a turn of the head frame, 1/rad.

    It moves every marker's place and the course.
    """
    found = np.zeros(len(features))
    along, across = np.moveaxis(marker_part(features), 1, 0)  # (m, 7) each
    found[marker_slice(len(features))] = np.stack([-across, along], axis=1).ravel()
    found[_course_places(len(features))[0]] = -features[SPEED]
    return found


def _wave_roots(blocks: Sequence[Block]) -> list[np.ndarray]:
    """Return the root (k, q) of a wave error of 100 % for each block, in phase where their tails are farthest left."""
    length, first = len(blocks[0].features), blocks[0].model
    markers = slice(marker_slice(length).stop)
    observed = np.array([block.model.reader.observed[markers] for block in blocks], float)  # (b, k)
    both = np.einsum("bi,bj->ij", observed, observed)
    waves = [wave_discrepancy(block.features[markers], first.along_m) for block in blocks]
    mean = sum(wave * np.outer(seen, seen) for wave, seen in zip(waves, observed, strict=True)) / np.maximum(both, 1.0)
    values, vectors = np.linalg.eigh(mean)
    root = np.zeros((length, markers.stop))
    root[markers] = vectors * np.sqrt(np.maximum(values, 0.0))
    phases = [float(beat_phase(block.features, list(block.model.trial.tail))) for block in blocks]
    return [advance_phase(root.T, phase).T for phase in phases]


def _lines(blocks: Sequence[Block], fitted: Sequence[Block]) -> list[np.ndarray]:
    """Return the columns (k, 2) of each block's speed error: constant, and linear in frequency.

    The unit is the fitted trials' mean speed.
    """
    middle_hz = float(np.exp(np.mean(np.log([block.model.trial.frequency.hz for block in fitted]))))
    mean_speed = float(np.mean([block.features[SPEED] for block in fitted]))
    unit = mean_speed * _unit_columns(len(blocks[0].features), [SPEED])
    relative = [block.model.trial.frequency.hz / middle_hz - 1 for block in blocks]
    return [np.hstack([unit, _SLOPE * each * unit]) for each in relative]
