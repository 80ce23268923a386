"""Fit of the twin to a free decay.

`fit_decay` matches first the peak of the spectrum, then the whole curve. "Simple Models, Real Swimming" (2026) turns
one stiffness for all hinges until the model's free decay rings like the robot's. Here the twin's spectrum is brought
onto the measured one in both peak and decay, and from there the lateral motion of all tail markers is fitted by
Gauss-Newton, together with what is not known of the release: the pose, the hinges' rates, where each box sits on its
marker, and the tilt of the head's axis. The release needs therefore not be clean, and the first frame fitted comes
after it.
"""

from dataclasses import replace
from functools import cached_property

import numpy as np
from threadpoolctl import threadpool_limits

from fitting.free_decay import DecaySpectrum, DecayTrial, measure_decay, spectrum_of
from fitting.hinges import DecayFit, DecayTwin, decay_flags, stable_scene, start_pose
from fitting.lasting_noise import LastingNoise, Regression, RegressionProblem, descend, regress, whitened
from swimcal.errors import SimulationDiverged
from swimcal.robot import RobotSpec

# Prior standard deviations. Those of tilt and scale come from boxes of nose and neck that sit 2 px off.
ANGLE_SD_RAD = 1.0  # angle of a hinge in the first frame
RATE_SD_RAD_S = 15.0  # rate of a hinge in the first frame
TILT_SD_RAD = 0.05  # tilt of the head's axis
SCALE_SD = 0.02  # relative error of the scale
OFFSET_SD_M = 0.02  # offset of a box from its marker
DAMPING_SD = 3.0  # logarithm of the damping
FIRST_NOISE = LastingNoise(0.1, 0.12, 0.001)  # first guess of the noise
LEAST_DAMPING_S = 1e-4  # least damping over stiffness from which a search may start
MATCHES = 4  # steps that match the spectrum, at most
ITERATIONS = 12  # Gauss-Newton steps, at most
STEP_SE = 3e-4  # relative error of stiffness and damping that the twin's finite step leaves
NEAR = 0.02  # relative step of stiffness and damping below which full steps are safe and residuals are noise
SETTLED = 5e-4  # relative change that ends the fit (the last one is still taken) …
SETTLED_SE = 0.2  # … or this share of the standard errors
# A sample farther from the twin than both of these is no tracking error.
OUTLIER_SD = 8.0
OUTLIER_M = 0.005
MOST_REJECTED = 0.1  # if a larger share of the samples is so far off, the twin is wrong
_SHARES = (1.0, 0.4, 0.1)  # shares of a step that are tried
_STEPS = (1e-4, 1e-4, 1e-4, 1e-2)  # finite differences of ln stiffness, ln damping, angle, rate

# The ring
NUMBERS = 2
"""Number of numbers in a ring: ln of stiffness over mass, and ln of damping over mass."""
TO_COME_SD = (0.009, 0.011)
"""Standard deviations of the numbers of a decay to come: the median of 35 decays of the second simulator."""


# The fit of the whole decay.


def fit_decay(trial: DecayTrial, robot: RobotSpec, workers: int = 0) -> DecayFit:
    """Fit one stiffness and one damping for all hinges such that the twin decays like the robot.

    Args:
        trial: the decay as measured.
        robot: its geometry and masses; its hinges are only where the search starts.
        workers: threads; 0 for all cores.

    Raises:
        SimulationDiverged: the twin of this robot cannot be simulated with the measured damping.
    """
    spectrum = measure_decay(trial)
    # A mode of a linear chain with equal hinges falls at the rate w^2 d / (2 k).
    own = robot.tail.hinge_damping_n_m_s / robot.tail.hinge_stiffness_n_m
    turn = 2 * np.pi * spectrum.peak_hz if spectrum.peak_hz else None
    ratio_s = max(own if turn is None else 2 * spectrum.decay_1_s / (turn**2 + spectrum.decay_1_s**2), LEAST_DAMPING_S)
    twin = DecayTwin(robot, trial.markers, stable_scene(ratio_s), workers)
    problem = _Problem(trial, twin, spectrum)
    with threadpool_limits(1):  # the matrices are small: threads cost more than they save
        matched = problem.match(robot.tail.hinge_stiffness_n_m, ratio_s)
        return _assemble(problem, *_descend(problem, problem.start(*matched)), matched[0])


class _Problem:
    """The decay as a least-squares problem in p = 4 + 2 h + k numbers.

    They are ln stiffness, ln damping, h angles, h rates, the tilt of the head's axis, the relative error of the scale
    (which wide swings feel, as their frequency depends on their width), and k offsets of boxes.
    """

    def __init__(self, trial: DecayTrial, twin: DecayTwin, spectrum: DecaySpectrum) -> None:
        self.trial, self.twin, self.spectrum = trial, twin, spectrum
        self.seen = trial.weight > 0  # (n, k)
        self.used = self.seen  # samples that `reject` keeps
        self.lateral = np.where(self.seen, trial.position_m[..., 1], 0.0)
        self._straight = twin.markers_at(np.zeros(twin.hinges))  # (k, 2)
        spread = [np.inf, DAMPING_SD, *twin.hinges * [ANGLE_SD_RAD], *twin.hinges * [RATE_SD_RAD_S]]
        self.precision = np.array([*spread, TILT_SD_RAD, SCALE_SD, *len(trial.markers) * [OFFSET_SD_M]]) ** -2.0
        self.prior = np.zeros(len(self.precision))

    @cached_property
    def first_pose(self) -> np.ndarray:
        """First pose (2, h): hinge angles from the markers in the first frame, and zero rates."""
        pose = start_pose(self.twin, self.trial.lateral_m[0], self.spectrum.rest_m)
        return np.stack([pose, np.zeros_like(pose)])

    def match(self, stiffness: float, damping_over_stiffness_s: float) -> tuple[float, float]:
        """Return the stiffness and damping whose twin has the measured peak and decay, from first hinges.

        For a linear chain with equal hinges, the squared natural frequency is proportional to the stiffness and the
        decay rate to the damping, so that scaling both by what is missing is Newton's method in logarithms.
        """
        wanted, damping = self.spectrum, stiffness * damping_over_stiffness_s
        for _ in range(MATCHES):
            moved = self.twin(np.array([stiffness]), np.array([damping]), self.first_pose[None], self.trial.time_s)
            if not np.isfinite(moved).all():
                break
            own = spectrum_of(self.trial.time_s, np.where(self.used, moved[0, ..., 1], np.nan))
            if wanted.peak_hz is None or own.peak_hz is None:
                break
            by = (wanted.peak_hz / own.peak_hz) ** 2, wanted.decay_1_s / own.decay_1_s
            stiffness *= float(np.clip(by[0], 0.1, 10.0))
            damping *= float(np.clip(by[1], 0.1, 10.0))
            if max(abs(by[0] - 1), abs(by[1] - 1)) < 1e-3:
                break
        return stiffness, damping

    def start(self, stiffness: float, damping: float) -> np.ndarray:
        """Return the start (p,) of the fit."""
        self.prior[1] = np.log(damping)
        offsets = self.spectrum.rest_m - self._straight[:, 1]
        return np.concatenate([[np.log(stiffness), np.log(damping)], *self.first_pose, [0.0, 0.0], offsets])

    def simulate(self, x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the lateral motion (s, n, k) at s points (s, p), and the markers' distances from rest (s, n, k, 2)."""
        h, k = self.twin.hinges, len(self.trial.markers)
        start = x[:, 2 : 2 + 2 * h].reshape(-1, 2, h)
        moved = self.twin(np.exp(x[:, 0]), np.exp(x[:, 1]), start, self.trial.time_s) - self._straight
        tilt, scale, offset = x[:, None, -k - 2, None], x[:, None, -k - 1, None], x[:, None, -k:]
        return self._straight[:, 1] + (1 + scale) * moved[..., 1] + tilt * moved[..., 0] + offset, moved

    def linearise(self, x: np.ndarray) -> RegressionProblem:
        """Linearise the model near x, from one batch of 3 + 2 h decays.

        Raises:
            SimulationDiverged: one of them blew up.
        """
        h, k = self.twin.hinges, len(self.trial.markers)
        steps = np.concatenate([_STEPS[:2], np.full(h, _STEPS[2]), np.full(h, _STEPS[3])])
        points = np.concatenate([x[None], x + np.eye(len(steps), len(x)) * steps[:, None]])
        lateral, moved = self.simulate(points)
        if not np.isfinite(lateral).all():
            raise SimulationDiverged(
                f"The free decay of the twin diverges at a stiffness of {np.exp(x[0]):.3g} N m/rad and a damping of "
                f"{np.exp(x[1]):.3g} N m s/rad. Expected a bounded motion; are the robot's masses right?"
            )
        simulated = (lateral[1:] - lateral[0]) / steps[:, None, None]  # (2 + 2 h, n, k)
        offsets = np.broadcast_to(np.eye(k), (len(self.trial.time_s), k, k))
        jacobian = np.concatenate([np.moveaxis(simulated, 0, -1), moved[0], offsets], axis=-1)
        return RegressionProblem(
            self.trial.time_s,
            self.used,
            np.where(self.seen, self.lateral - lateral[0], 0.0),
            np.where(self.seen[..., None], jacobian, 0.0),
            self.precision * (self.prior - x),
            self.precision,
        )

    def reject(self, residual: np.ndarray) -> bool:
        """Leave out the few samples that no tracking error explains, and tell whether they are others than before.

        The farthest is left out alone at first: it draws the twin away from samples that are right, which come back
        then.
        """
        size: np.ndarray = np.where(self.seen, np.abs(residual), 0.0)  # (n, k)
        sd_m = 1.4826 * float(np.median(size[np.nonzero(self.seen)]))
        far: np.ndarray = size > max(OUTLIER_SD * sd_m, OUTLIER_M, 0.5 * float(size.max()))
        if far.sum() > MOST_REJECTED * self.seen.sum():
            far = np.zeros_like(self.seen)
        before, self.used = self.used, self.seen & ~far
        return bool((before != self.used).any())

    def costs(self, x: np.ndarray, noise: LastingNoise) -> np.ndarray:
        """Return minus twice the log posterior (s,) at s points (s, p)."""
        residual = np.where(self.used, self.lateral - self.simulate(x)[0], 0.0)  # (s, n, k)
        bad = np.logical_not(np.isfinite(residual).all(axis=(1, 2)))  # (s,)
        series = np.moveaxis(np.where(bad[:, None, None], 0.0, residual), 0, -1)
        white = whitened(self.trial.time_s, self.used, series, noise)[0] / noise.sd_m
        cost = (white**2).sum(axis=(0, 1)) + (self.precision * (x - self.prior) ** 2).sum(axis=1)
        return np.where(bad, np.inf, cost)


def _descend(problem: _Problem, x: np.ndarray) -> tuple[np.ndarray, Regression, bool]:
    """Descend by Gauss-Newton under a first guess of the noise until it is near, then under the noise found there.

    A step to where the twin diverges is halved.

    Returns:
        Where it ends, (p,), the regression there, and whether it settled.
    """
    noise, found = FIRST_NOISE, False
    model, held = problem.linearise(x), x
    for _ in range(ITERATIONS):
        if x is not held:
            try:
                model, held = problem.linearise(x), x
            except SimulationDiverged:  # too far in one step
                x = 0.5 * (held + x)
                continue
        guess = descend(model, noise)
        if not found and _size(guess) < NEAR:
            if problem.reject(model.residual - model.jacobian @ guess.step):
                model = problem.linearise(x)
                continue
            noise, found = regress(model).noise, True
            guess = descend(model, noise)
        errors = np.sqrt(np.diag(guess.covariance)[:2])
        if found and (np.abs(guess.step[:2]) < np.maximum(SETTLED, SETTLED_SE * errors)).all():
            result = regress(model)
            return x + result.step, result, True
        x = x + guess.step if _size(guess) < NEAR else _search(problem, x, guess.step, noise)
    return held, regress(model), False


def _size(guess: Regression) -> float:
    return float(np.abs(guess.step[:2]).max())


def _search(problem: _Problem, x: np.ndarray, step: np.ndarray, noise: LastingNoise) -> np.ndarray:
    """Return the best of some points along a long step."""
    step = np.concatenate([np.clip(step[:2], -1.0, 1.0), step[2:]])
    tried = x + np.outer(_SHARES, step)
    return tried[int(np.argmin(problem.costs(tried, noise)))]


def _assemble(
    problem: _Problem, x: np.ndarray, result: Regression, converged: bool, matched_stiffness_n_m: float
) -> DecayFit:
    trial, spectrum, k = problem.trial, problem.spectrum, len(problem.trial.markers)
    stiffness, damping = np.exp(x[:2])
    relative = np.sqrt(np.diag(result.covariance)[:2] + STEP_SE**2)
    simulated = problem.simulate(x[None])[0][0]  # (n, k)
    residual = np.where(problem.used, problem.lateral - simulated, np.nan)
    rest = (problem.used * problem.lateral).sum(axis=0) / np.maximum(problem.used.sum(axis=0), 1)  # (k,)
    moved = float(np.nansum(np.where(problem.used, problem.lateral - rest, 0.0) ** 2))
    found = DecayFit(
        name=trial.name,
        stiffness_n_m=float(stiffness),
        stiffness_se_n_m=float(stiffness * relative[0]),
        damping_n_m_s=float(damping),
        damping_se_n_m_s=float(damping * relative[1]),
        matched_stiffness_n_m=matched_stiffness_n_m,
        spectrum=spectrum,
        noise=result.noise,
        start_rad=x[2 : 2 + 2 * problem.twin.hinges].reshape(2, -1),
        time_s=trial.time_s,
        markers=trial.markers,
        measured_m=np.where(problem.used, problem.lateral, np.nan) - x[-k:],
        simulated_m=simulated - x[-k:],
        rms_m=float(np.sqrt(np.nanmean(residual**2))),
        explained=max(1.0 - float(np.nansum(residual**2)) / max(moved, 1e-300), 0.0),
        converged=converged,
        flags=(*trial.flags, *spectrum.flags),
    )
    flags = decay_flags(trial, found, problem.seen & ~problem.used)
    return replace(found, flags=(*found.flags, *flags))
