"""The linearised model at the fitted coefficients: what a session shows in one row, and all that disturbs it."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from scipy.linalg import solve_triangular

from diagnosis.discrepancy import Discrepancy
from diagnosis.generic import GaussianProcessDiscrepancy, generic_covariance
from diagnosis.tolerances import TAKEN, perturbed_robots, placement_uncertainty
from fitting.free_decay import Ring
from fitting.model.session_model import START_PHASE_RAD, NuisanceModel, PlacementUncertainty, SessionModel
from fitting.model.trial_model import TrialModel
from fitting.model.variance import apart
from fitting.signatures import Whitened
from fitting.signatures.session_row import PRIOR_SD, residual_row, row_covariance, row_slopes
from fitting.trial import MeasuredTrial
from session import CameraSpec
from session.errors import SimulationDiverged
from swimmer import Twin
from swimmer.fluid import COEFFICIENT_BOUNDS
from swimmer.mjcf import DRY

_LEAST_BOX_M = TAKEN.box_m / 3  # boxes are placed by hand, however well the means happen to agree


@dataclass(frozen=True, eq=False)
class LinearModel:
    """The trials of one role beside the twin that was fitted: swims, and dry runs after them.

    A row holds the features of t trials, and then the frequencies that their commands lead to, as they were filmed and,
    where motors were logged, as they turned; and then how free decays ring: k numbers in all.

    Attributes:
        model: the swims beside the plain twin.
        camera: that filmed them.
        at: (5,) the recommended coefficients of the session.
        discrepancy: what the refitted twin leaves where nothing is wrong.
        off: how far boxes and markers are off; for markers stands an effect of the catalogue.
        disturbances: what noise and nuisances do, at the coefficients.
        error: size of what the twin leaves of the features of each in this session, against most sessions.
        common: (k, c) what it leaves of all trials alike, of unit strength; None where that is not known.
    """

    model: SessionModel
    camera: CameraSpec
    at: np.ndarray
    discrepancy: Discrepancy
    off: PlacementUncertainty
    disturbances: NuisanceModel
    error: float = 1.0
    common: np.ndarray | None = None

    @classmethod
    def of(
        cls,
        trials: Sequence[MeasuredTrial],
        twin: Twin,
        camera: CameraSpec,
        discrepancy: Discrepancy,
        at: np.ndarray,
        dry: Sequence[MeasuredTrial] = (),
        rings: Sequence[Ring] = (),
    ) -> "LinearModel":
        """Of the swims that coefficients were fitted to, and of what was measured in air, which tells nothing of these.

        Raises:
            SimulationDiverged: the twin at these coefficients, or next to them.
        """
        model = _beside(twin, trials)
        clamped = _beside(_clamped(twin), dry).trials if dry else ()
        model = SessionModel((*model.trials, *clamped), tuple(rings))
        disturbances = model.disturbances(at)
        residual = residual_row(model, at)
        if not (disturbances.finite and np.isfinite(residual).all()):
            raise SimulationDiverged("the plain twin diverged at the fitted coefficients; fit the session again")
        found = cls(model, camera, at, discrepancy, _placement_uncertainty(model, residual, disturbances), disturbances)
        found.__dict__["residual"] = residual
        return found

    @cached_property
    def generic(self) -> np.ndarray:
        """(k, k) covariance of a gap of no particular cause that is one metre large."""
        first = self.model.trials[0]
        along_m = first.twin.robot.marker_positions_m(first.trial.markers)[:, 0]
        return generic_covariance(along_m, len(self.trials), self.model.frequencies, self.model.of_rings)

    @cached_property
    def with_gap(self) -> Whitened:
        """As `space`, with what the plain twin leaves counted as disturbance: in this, twins are fitted."""
        return self.with_gap_in(self.residual)

    def with_gap_in(self, residual: np.ndarray) -> Whitened:
        """As `space`, with what some twin leaves (k,) counted as disturbance."""
        return Whitened.of(self.covariance_with_gap_in(residual), self.slopes, PRIOR_SD)

    def covariance_with_gap_in(self, residual: np.ndarray) -> np.ndarray:
        """(k, k) `covariance` with what some twin leaves (k,) counted as disturbance."""
        return self.covariance + self._gap.covariance(residual)

    @cached_property
    def _gap(self) -> GaussianProcessDiscrepancy:
        measured = apart(self.generic, self.observed, 0.0)
        return GaussianProcessDiscrepancy(self.covariance, measured, self.model.frequencies, self.model.of_rings)

    def other_trials(self, trials: Sequence[MeasuredTrial], twin: Twin) -> "LinearModel":
        """The same of trials beside a twin that may be clamped, their boxes as far off as those of the fitted ones."""
        model = _beside(twin, trials)
        return replace(self, model=model, disturbances=model.disturbances(self.at), common=None)

    def with_error(self, error: float, common: np.ndarray) -> "LinearModel":
        """The same with what the twin leaves of it where nothing is wrong, see `error` and `common`.

        Of free decays nothing: it is how the twin moves in water that is like some effects, and no hinge is another.
        """
        of_swims = np.array(common)
        of_swims[self.model.places_of_rings] = 0.0
        found = replace(self, error=error, common=of_swims)
        known = {"residual": self.residual, "slopes": self.slopes, "generic": self.generic, "_of_twin": self._of_twin}
        found.__dict__.update(known)  # as they were, and not cheap
        return found

    @property
    def trials(self) -> tuple[MeasuredTrial, ...]:
        """The swims, and the dry runs after them."""
        return tuple(each.trial for each in self.model.trials)

    @property
    def swims(self) -> tuple[MeasuredTrial, ...]:
        """Without the dry runs."""
        return tuple(each.trial for each in self.model.trials if not each.twin.scene.head_clamped)

    @cached_property
    def trial_of(self) -> np.ndarray:
        """(k,) number of the trial that each number of the row is of; -1 of free decays."""
        trials = np.arange(len(self.trials))
        own = len(self.model.measured) // len(trials)
        whose = [np.repeat(trials, own), trials, np.array(self.model.logged, int), np.full(self.model.of_rings, -1)]
        return np.concatenate(whose)

    @cached_property
    def observed(self) -> np.ndarray:
        """(k,) numbers that are measured: all but the features of markers that are not read."""
        return np.concatenate([self.model.observed, np.ones(self.model.beside, bool)])

    @cached_property
    def scored(self) -> np.ndarray:
        """(q,) places of the observed features of all swims, which are scored."""
        features = len(self.model.measured) // len(self.trials) * len(self.swims)
        return np.flatnonzero(self.observed[:features])

    def whitened_swims(self, residual: np.ndarray) -> np.ndarray:
        """(..., q) of unit noise, the observed features of all swims in residuals (..., k).

        Without frequencies and decays, which are data of their own.
        """
        root = np.linalg.cholesky(self.covariance[np.ix_(self.scored, self.scored)])
        return np.asarray(solve_triangular(root, residual[..., self.scored].T, lower=True).T)

    @property
    def has_dry(self) -> bool:
        """Whether there is a dry run."""
        return len(self.swims) < len(self.trials)

    @property
    def clamped_twin(self) -> Twin:
        """The plain twin with its head clamped in air."""
        return _clamped(self.twin)

    @property
    def twin(self) -> Twin:
        """The plain one."""
        return self.model.trials[0].twin

    @cached_property
    def residual(self) -> np.ndarray:
        """(k,) measured less simulated."""
        return residual_row(self.model, self.at)

    def residual_drawn(self, fitted: "LinearModel", draws: int, seed: int) -> np.ndarray:
        """(d, k) what plain twins would leave of these swims, fitted to others as they might have been: linear.

        What the plain twin leaves of the others counts as disturbance. All nan where the twin diverges next to it.
        """
        random = np.random.default_rng([seed, 23])
        drawn = random.multivariate_normal(self.at, fitted.coefficient_covariance, draws)
        return self.residual - (np.clip(drawn, *COEFFICIENT_BOUNDS) - self.at) @ self.slopes.T

    @cached_property
    def coefficient_covariance(self) -> np.ndarray:
        """(5, 5) of the coefficients as fitted, what the plain twin leaves counted as disturbance."""
        slopes = solve_triangular(self.with_gap.root, self.slopes, lower=True)
        return np.linalg.inv(slopes.T @ slopes + np.diag(self.with_gap.precision))

    @cached_property
    def slopes(self) -> np.ndarray:
        """(k, 5) of the row with the coefficients."""
        return row_slopes(self.model, self.at)

    @cached_property
    def covariance(self) -> np.ndarray:
        """(k, k) of all that disturbs the row."""
        features = self.disturbances.of(self.off) + self.error**2 * self._of_twin
        own = row_covariance(self.model, features, self.disturbances.robot)
        return own if self.common is None else own + self.common @ self.common.T

    @cached_property
    def _of_twin(self) -> np.ndarray:
        """(k, k) what the twin leaves of the features where nothing is wrong, in most sessions."""
        return self.discrepancy.over(self.model)

    @cached_property
    def space(self) -> Whitened:
        """In which all that disturbs the row has unit size and coefficients are free."""
        return Whitened.of(self.covariance, self.slopes, PRIOR_SD)


def _placement_uncertainty(
    model: SessionModel, residual: np.ndarray, disturbances: NuisanceModel
) -> PlacementUncertainty:
    """Boxes by what trials differ by; what they have in common is for effects to explain, and no box's."""
    found = placement_uncertainty(residual[: len(model.measured)], len(model.trials), disturbances, model.observed)
    return PlacementUncertainty(max(found.box_m, _LEAST_BOX_M), TAKEN.marker_m)


def _clamped(twin: Twin) -> Twin:
    return Twin(twin.robot, twin.markers, DRY, twin.workers)


def _beside(twin: Twin, trials: Sequence[MeasuredTrial]) -> SessionModel:
    doubted = perturbed_robots(twin)
    return SessionModel(tuple(TrialModel(twin, trial, START_PHASE_RAD, doubted, with_course=True) for trial in trials))
