"""Linear model of a session's features about the fitted twin, and the recordings that it is made of.

`SessionData` holds the recordings, with the free decays that are believed; `SessionData.linear` makes the
`LinearModel`: residual, Jacobian by the coefficients, covariance of all that disturbs them, and the whitened space.
"""

from collections.abc import Callable, Mapping, Sequence
from copy import copy
from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np
from scipy.linalg import block_diag, solve_triangular

from diagnosis.constants import (
    COURSE_OF_LAUNCH,
    CREEP_OF_LAUNCH,
    CREEP_SD_M_S,
    SLIDE_OF_LAUNCH_PER_S,
    TAKEN,
    TILT_PER_M,
    perturbed_robots,
    placement_uncertainty,
)
from diagnosis.discrepancy import Discrepancy, GaussianProcessDiscrepancy, generic_covariance
from fitting.affected_trials import with_picture
from fitting.covariance import apart
from fitting.decay_fit import fit_decay
from fitting.features import COURSE, SPEED, marker_part, places_of_slides
from fitting.free_decay import DecayTrial
from fitting.hinges import fault_of_decay
from fitting.ring import Ring
from fitting.session_model import NuisanceModel, PlacementUncertainty, SessionModel
from fitting.signatures import PRIOR_SD, Whitened, residual_row, row_covariance, row_slopes
from fitting.trial import NOTHING, ExperimentsInAir, MeasuredTrial
from fitting.trial_model import TrialModel
from swimcal.errors import NotEnoughData, SimulationDiverged
from swimcal.mjcf import COEFFICIENT_BOUNDS, DRY
from swimcal.session_file import CameraSpec
from swimcal.twin import Twin


class Given(NamedTuple):
    """Knowledge about a row of k numbers from other recordings of the same robot, before it is measured.

    Attributes:
        foretold: (k,) residual of the twin that they lead to expect.
        covariance: (k, k) covariance of the row about it, the coefficients' own uncertainty included.
        prior_sd: (5,) standard deviations of what is left to the coefficients.
        held_out: makes the model of other trials of the same session, given the same recordings.
    """

    foretold: np.ndarray
    covariance: np.ndarray
    prior_sd: np.ndarray
    held_out: Callable[[Sequence[MeasuredTrial]], "LinearModel"]


_LEAST_BOX_M = TAKEN.box_m / 3  # boxes are placed by hand, however well the means happen to agree


@dataclass(frozen=True, eq=False)
class LinearModel:
    """Linearised model of the trials of one role: swims, and dry runs after them.

    A row holds the features of t trials; then the frequencies that their commands lead to, as they were filmed and,
    where motors were logged, as they turned; and then the numbers of free decays: k numbers in all.

    Attributes:
        model: the trials with the plain twin.
        camera: the camera that filmed them.
        at: (5,) the recommended coefficients of the session.
        discrepancy: discrepancy of the refitted twin where nothing is wrong.
        off: how far boxes and markers are off; for markers there is an effect in the catalogue.
        disturbances: what noise and nuisances do, at the coefficients.
        error: size of the discrepancy of each trial's features in this session, against most sessions.
        common: (k, c) discrepancy that all trials share, of unit strength; None where that is not known.
        launch: sizes of what the course differs by from launch to launch, and slides of markers, against the usual.
        given: what a reference session tells of these trials; None without one.
    """

    model: SessionModel
    camera: CameraSpec
    at: np.ndarray
    discrepancy: Discrepancy
    off: PlacementUncertainty
    disturbances: NuisanceModel
    error: float = 1.0
    common: np.ndarray | None = None
    launch: tuple[float, float] = (0.0, 0.0)
    given: Given | None = None

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
        """Build the model of the swims that coefficients were fitted to, and of measurements in air.

        The latter do not affect the coefficients.

        Args:
            trials: the fitted swims.
            twin: the plain twin.
            camera: the camera that filmed them.
            discrepancy: discrepancy of the refitted twin where nothing is wrong.
            at: (5,) the fitted coefficients.
            dry: dry runs.
            rings: fits of free decays.

        Raises:
            SimulationDiverged: the twin diverged at these coefficients, or next to them.
        """
        model = _model_session(twin, trials)
        clamped = _model_session(_clamp(twin), dry).trials if dry else ()
        model = SessionModel((*model.trials, *clamped), tuple(rings))
        disturbances = model.disturbances(at)
        residual = residual_row(model, at)
        if not (disturbances.finite and np.isfinite(residual).all()):
            raise SimulationDiverged("the plain twin diverged at the fitted coefficients; fit the session again")
        placed = placement_uncertainty(residual[: len(model.measured)], len(model.trials), disturbances, model.observed)
        off = PlacementUncertainty(max(placed.box_m, _LEAST_BOX_M), TAKEN.marker_m)  # effects explain what trials share
        found = cls(model, camera, at, discrepancy, off, disturbances)
        found.__dict__["residual"] = residual
        return found

    @cached_property
    def generic(self) -> np.ndarray:
        """Covariance (k, k) of a gap of no particular cause that is one metre large."""
        model = self.model
        along_m = model.trials[0].along_m
        return generic_covariance(along_m, len(self.trials), model.frequencies, model.of_creeps, model.of_rings)

    @cached_property
    def generic_root(self) -> np.ndarray:
        """Columns (k, k) of which `generic` is the product with their transpose."""
        values, vectors = np.linalg.eigh(self.generic)
        return np.asarray(vectors * np.sqrt(np.maximum(values, 0.0)))

    @cached_property
    def with_gap(self) -> Whitened:
        """The space of `space` with the plain twin's residual counted as disturbance: in this, twins are fitted."""
        return self.with_gap_in(self.residual)

    def with_gap_in(self, residual: np.ndarray) -> Whitened:
        """Return the space of `space` with the residual (k,) of some twin counted as disturbance."""
        return Whitened.of(self.covariance_with_gap_in(residual), self.slopes, self.prior_sd)

    def covariance_with_gap_in(self, residual: np.ndarray) -> np.ndarray:
        """Return `covariance` (k, k) with the residual (k,) of some twin counted as disturbance."""
        return self.covariance + self._gap.covariance(residual)

    @cached_property
    def _gap(self) -> GaussianProcessDiscrepancy:
        measured = apart(self.generic, self.observed, 0.0)
        sizes = self.model.frequencies, self.model.of_creeps, self.model.of_rings
        return GaussianProcessDiscrepancy(self.covariance, measured, *sizes)

    def other_trials(self, trials: Sequence[MeasuredTrial], twin: Twin) -> "LinearModel":
        """Return the model of other trials; boxes are as far off as in the fitted ones.

        Args:
            trials: the trials.
            twin: their twin, which may be clamped.
        """
        if self.given is not None:
            return self.given.held_out(trials)
        model = _model_session(twin, trials)
        return replace(self, model=model, disturbances=model.disturbances(self.at), common=None)

    def with_error(self, error: float, common: np.ndarray, launch: tuple[float, float] = (0.0, 0.0)) -> "LinearModel":
        """Return the model with another size and common part of the discrepancy, and another scatter of launches.

        The common part of free decays is zero: it is due to water that resembles some effects, which no hinge does.

        Args:
            error: size of the discrepancy, against most sessions.
            common: (k, c) part that all trials share, of unit strength.
            launch: sizes of the scatter of course and slides, against the usual.
        """
        of_swims = np.array(common)
        of_swims[self.model.places_of_rings] = 0.0
        found = replace(self, error=error, common=of_swims, launch=launch)
        unchanged = ("residual", "slopes", "generic", "generic_root", "_of_twin")
        found.__dict__.update({name: getattr(self, name) for name in unchanged})  # expensive to compute
        return found

    def with_residual(self, residual: np.ndarray) -> "LinearModel":
        """Return the model with another residual (k,), such as what a refitted twin leaves; all else stays."""
        found = copy(self)
        for name in ("with_gap", "coefficient_covariance"):  # these depend on it
            found.__dict__.pop(name, None)
        found.__dict__["residual"] = residual
        return found

    @property
    def trials(self) -> tuple[MeasuredTrial, ...]:
        """The swims, and the dry runs after them."""
        return tuple(each.trial for each in self.model.trials)

    @property
    def swims(self) -> tuple[MeasuredTrial, ...]:
        """The swims, without the dry runs."""
        return tuple(each.trial for each in self.model.trials if not each.twin.scene.head_clamped)

    @cached_property
    def trial_of(self) -> np.ndarray:
        """Number of the trial that each number of the row belongs to, (k,); -1 for free decays."""
        trials = np.arange(len(self.trials))
        own = len(self.model.measured) // len(trials)
        hertz = [trials, np.array(self.model.logged, int)]
        creeps = np.repeat(trials, self.model.of_creeps // len(trials))
        return np.concatenate([np.repeat(trials, own), *hertz, creeps, np.full(self.model.of_rings, -1)])

    @cached_property
    def observed(self) -> np.ndarray:
        """Return whether each number of the row is measured, (k,): all but those of markers that are not read."""
        found = np.concatenate([self.model.observed, np.ones(self.model.beside, bool)])
        found[self.model.places_of_creeps] = self.model.creeps_observed
        return found

    @cached_property
    def scored(self) -> np.ndarray:
        """Places of the observed features of all swims, which are scored, (q,)."""
        features = len(self.model.measured) // len(self.trials) * len(self.swims)
        return np.flatnonzero(self.observed[:features])

    def whitened_swims(self, residual: np.ndarray) -> np.ndarray:
        """Return the observed features of all swims in residuals (..., k), whitened to unit noise (..., q).

        Frequencies and decays are left out, as they are data of their own.
        """
        root = np.linalg.cholesky(self.covariance[np.ix_(self.scored, self.scored)])
        return np.asarray(solve_triangular(root, residual[..., self.scored].T, lower=True).T)

    @cached_property
    def parts(self) -> np.ndarray:
        """Parts of the row that a form error changes one by one, (g, k): in each trial five of the swim, and decays."""
        model, trials = self.model, len(self.trials)
        own = len(model.measured) // trials
        kind = np.full(own, 1)
        kind[SPEED] = 0
        marker_part(kind)[:, 0, 1:3] = 2  # how the first harmonic moves along the fish
        marker_part(kind)[:, 1, 1:3] = 3  # and across
        marker_part(kind)[..., 3:] = 4
        beside = np.zeros(len(self.observed) - own * trials, int)
        kinds = np.concatenate([np.tile(kind, trials), beside])
        kinds[model.places_of_creeps] = 1
        whole = 5 * self.trial_of + kinds
        return np.array([whole == number for number in np.unique(whole)])

    @property
    def clamped_twin(self) -> Twin:
        """The plain twin with its head clamped in air."""
        return _clamp(self.twin)

    @property
    def twin(self) -> Twin:
        """The plain twin."""
        return self.model.trials[0].twin

    @cached_property
    def residual(self) -> np.ndarray:
        """Residual (k,), measured less simulated, and less what a reference session foretells."""
        return residual_row(self.model, self.at) - self.foretold

    @property
    def foretold(self) -> np.ndarray:
        """Residual (k,) that a reference session foretells; 0 without one."""
        return np.zeros(len(self.observed)) if self.given is None else self.given.foretold

    @property
    def prior_sd(self) -> np.ndarray:
        """Standard deviations (5,) of the prior of the coefficients about `at`."""
        return PRIOR_SD if self.given is None else self.given.prior_sd

    def residual_drawn(self, fitted: "LinearModel", draws: int, seed: int) -> np.ndarray:
        """Return the residuals (d, k) of these swims under draws of the coefficients fitted to other swims; linear.

        The plain twin's residual of the others counts as disturbance. All are nan where the twin diverges next to it.

        Args:
            fitted: the model of the fitted swims.
            draws: number of draws.
            seed: seed of the draws.
        """
        random = np.random.default_rng([seed, 23])
        drawn = random.multivariate_normal(self.at, fitted.coefficient_covariance, draws)
        return self.residual - (np.clip(drawn, *COEFFICIENT_BOUNDS) - self.at) @ self.slopes.T

    @cached_property
    def coefficient_covariance(self) -> np.ndarray:
        """Covariance (5, 5) of the fitted coefficients, the plain twin's residual counted as disturbance."""
        slopes = solve_triangular(self.with_gap.root, self.slopes, lower=True)
        return np.linalg.inv(slopes.T @ slopes + np.diag(self.with_gap.precision))

    @cached_property
    def slopes(self) -> np.ndarray:
        """Jacobian (k, 5) of the row by the coefficients."""
        return row_slopes(self.model, self.at)

    @cached_property
    def covariance(self) -> np.ndarray:
        """Covariance (k, k) of all that disturbs the row."""
        if self.given is not None:
            return self.given.covariance
        features = self.disturbances.of(self.off) + self.error**2 * self._of_twin
        if any(self.launch):
            features = features + np.diag(scatter_of_launch(self.model, *self.launch) ** 2)
        own = row_covariance(self.model, features, self.disturbances.robot)
        creeps = self.model.places_of_creeps
        own[creeps, creeps] += self.error**2 * CREEP_SD_M_S**2 * np.eye(self.model.of_creeps)
        own[creeps, creeps] += self.launch[1] ** 2 * scatter_of_creeps(self.model)
        return own if self.common is None else own + self.common @ self.common.T

    @cached_property
    def _of_twin(self) -> np.ndarray:
        """Covariance (k, k) of the discrepancy of the features where nothing is wrong, in most sessions."""
        return self.discrepancy.over(self.model)

    @cached_property
    def space(self) -> Whitened:
        """Whitened residual space: all that disturbs the row has unit size, and coefficients are free."""
        return Whitened.of(self.covariance, self.slopes, self.prior_sd)


def scatter_of_launch(model: SessionModel, course: float = 1.0, slides: float = 1.0) -> np.ndarray:
    """Return the standard deviations (k,) of all features between launches: of the course, and of markers' slides.

    With the head clamped they are 0.

    Args:
        model: the trials.
        course: size of the scatter of the course, against the usual.
        slides: the same of the slides, which a tilted camera makes.
    """
    along_m = model.trials[0].along_m
    own = np.zeros(len(model.measured) // len(model.trials))
    places = places_of_slides(len(own))
    own[places] = slides * SLIDE_OF_LAUNCH_PER_S * np.abs(along_m[: places.stop - places.start])
    own[-len(COURSE) :] = np.multiply(course, COURSE_OF_LAUNCH)
    free = [not each.twin.scene.head_clamped for each in model.trials]
    return np.kron(free, own)


def slides_of_tilt(model: SessionModel) -> np.ndarray:
    """Return how all features (k, 2) answer to a camera's tilt of `TILT_PER_M` about either axis of the picture.

    To first order a camera at height h that is tilted by the small angles g h shows a place x at (1 + g x) x (pinhole
    camera; Hartley and Zisserman, Multiple View Geometry, section 6.1). So along a body that swims with speed v in
    direction u a marker at a place a slides by 2 a v (g u), m/s. With the head clamped none does.

    Args:
        model: the trials.
    """
    found = []
    for each in model.trials:
        trial, own = each.trial, np.zeros((len(model.measured) // len(model.trials), 2))
        places = places_of_slides(len(own))
        heading_rad = trial.tracks.heading.values[trial.kept]
        towards = np.array([np.nanmean(np.cos(heading_rad)), np.nanmean(np.sin(heading_rad))])
        moving = 0.0 if each.twin.scene.head_clamped else 2 * trial.speed * TILT_PER_M
        along_m = each.along_m[: places.stop - places.start]
        own[places] = moving * np.outer(along_m - along_m.mean(), towards)  # slides are from their mean
        found.append(own)
    return np.vstack(found)


def scatter_of_creeps(model: SessionModel) -> np.ndarray:
    """Return the covariance (c, c) of the markers' speeds aside between launches, m^2/s^2.

    Each marker slides by itself, a high one more. With the head clamped none does.
    """
    found = [np.zeros((0, 0))]
    for each in model.trials if model.of_creeps else ():
        height_m = each.twin.robot.marker_positions_m(each.trial.markers)[:, 2]
        above_m = height_m - height_m[[each.reader.nose, each.reader.neck]].mean()
        sd = np.hypot(CREEP_OF_LAUNCH[0], CREEP_OF_LAUNCH[1] * above_m) * (not each.twin.scene.head_clamped)
        slides = each.reader.against_neighbours(each.along_m) * sd
        found.append(slides @ slides.T)
    return np.asarray(block_diag(*found))


def _clamp(twin: Twin) -> Twin:
    return Twin(twin.robot, twin.markers, replace(DRY, timestep_s=twin.scene.timestep_s), twin.workers)


def _model_session(twin: Twin, trials: Sequence[MeasuredTrial]) -> SessionModel:
    doubted = perturbed_robots(twin)
    return SessionModel(tuple(TrialModel.of(twin, trial, doubted, with_course=True) for trial in trials))


# The recordings that the model is made of.


@dataclass(frozen=True, eq=False)
class SessionData:
    """The recordings of a session, and what was known before.

    The crank of a trial with a motor log turns as it was logged, as in the fit: a fault of the drive shows in how fast
    it turned, against the command.

    Attributes:
        trials: all swims; those of the role "fit" determine the effect, the others score it.
        twin: the plain twin, of the robot as described.
        camera: the camera that filmed them.
        discrepancy: discrepancy of a refitted twin where nothing is wrong.
        at: (5,) the recommended coefficients of the session, fitted to the same swims.
        dry: measurements out of the water, which also determine the effect.
        doubted: names of fitted swims that their own twin does not follow; with these no effect is named.
        reference: recordings of the same robot, camera and water before something changed; None without.
    """

    trials: Sequence[MeasuredTrial]
    twin: Twin
    camera: CameraSpec
    discrepancy: Discrepancy
    at: np.ndarray
    dry: ExperimentsInAir = NOTHING
    doubted: tuple[str, ...] = ()
    reference: "SessionData | None" = None

    def of_role(self, fitted: bool) -> tuple[MeasuredTrial, ...]:
        """Return the swims that are fitted, or those that are not."""
        return tuple(trial for trial in self.trials if (trial.role == "fit") == fitted)

    @cached_property
    def rings(self) -> "FreeDecayFits":
        """Fits of the free decays."""
        return free_decay_fits(self.dry.decays, self.twin)

    @property
    def linear(self) -> LinearModel:
        """Linearised model of the fitted trials.

        Raises:
            NotEnoughData: there is none.
            SimulationDiverged: the twin diverged at these coefficients.
        """
        if not (fitted := self.of_role(fitted=True)):
            raise NotEnoughData('no swim of role "fit"; a diagnosis needs at least one')
        runs = self.dry.runs
        camera = with_picture(self.camera, (*fitted, *self.of_role(fitted=False), *runs))
        return LinearModel.of(fitted, self.twin, camera, self.discrepancy, self.at, runs, self.rings.believed)


class FreeDecayFits(NamedTuple):
    """Free decays of a session: fits of those that are believed, and by name why others are left out."""

    believed: tuple[Ring, ...]
    left_out: Mapping[str, str]


def free_decay_fits(decays: Sequence[DecayTrial], twin: Twin) -> FreeDecayFits:
    """Fit the free decays, and leave out those whose fit must not be believed (`fault_of_decay`)."""
    believed, left_out = [], {}
    for trial in decays:
        try:
            fit = fit_decay(trial, twin.robot, workers=twin.workers)
            doubt, ring = fault_of_decay(fit), Ring.of(trial, fit, twin.robot)
            if doubt is None and not np.isfinite(ring.of_twin(twin)).all():
                doubt = "a twin with the fitted hinges does not stand"
        except SimulationDiverged as problem:
            doubt = str(problem)
        if doubt is None:
            believed.append(ring)
        else:
            left_out[trial.name] = doubt
    return FreeDecayFits(tuple(believed), left_out)
