"""Tolerances where nothing is wrong: of boxes, of markers, and of the robot against its description."""

import numpy as np
from scipy.optimize import minimize

from diagnosis.constants import WITHIN
from fitting.model.features import of_markers
from fitting.model.session_model import NuisanceModel, PlacementUncertainty
from fitting.structure import ParameterUncertainty, PerturbedTwin, Source, assumed, perturbed_twins
from swimmer import RobotSpec, Twin

TAKEN = PlacementUncertainty(box_m=0.003, marker_m=0.001)
"""Prior errors: boxes are off by a few pixels, markers by as much as a ruler allows."""

_LN_SD = 0.7  # prior standard deviation of the logarithm of either size
_ENDS_M = (1e-4, 0.05)
_STARTS = ((1.0, 1.0), (3.0, 1.0), (1.0, 10.0))  # starts of the search, relative to the prior's centre
_STEP = 0.05  # relative step of a mass, either way


def placement_uncertainty(
    residual: np.ndarray, trials: int, disturbances: NuisanceModel, observed: np.ndarray | None = None
) -> PlacementUncertainty:
    """Return the likeliest sizes of the errors of boxes and markers.

    Args:
        residual: (k,) residual of the features.
        trials: number of trials that they are of.
        disturbances: what noise and nuisances do to them.
        observed: (k,) features that are measured; default all.
    """
    means = mean_places(len(residual), trials)
    means = means if observed is None else means[observed[means]]
    off, fixed = residual[means], disturbances.fixed[np.ix_(means, means)]
    boxes, markers = (part @ part.T for part in (disturbances.per_box[means], disturbances.per_marker[means]))
    taken = np.log(TAKEN)

    def deviance(ln_sd: np.ndarray) -> float:
        covariance = fixed + np.exp(2 * ln_sd[0]) * boxes + np.exp(2 * ln_sd[1]) * markers
        prior = (((ln_sd - taken) / _LN_SD) ** 2).sum()
        return float(off @ np.linalg.solve(covariance, off) + np.linalg.slogdet(covariance)[1] + prior)

    ends = [tuple(np.log(_ENDS_M))] * 2
    found = [
        minimize(deviance, taken + np.log(start), method="L-BFGS-B", bounds=ends, options={"ftol": 1e-7})
        for start in _STARTS
    ]
    return PlacementUncertainty(*map(float, np.exp(min(found, key=lambda each: float(each.fun)).x)))


def mean_places(length: int, trials: int) -> np.ndarray:
    """Return where a row of features holds the means of its markers, (2 m t,).

    Args:
        length: number of features in the row, k.
        trials: number of trials, t.
    """
    return of_markers(np.arange(length).reshape(trials, -1))[..., 0].ravel()


def perturbed_robots(twin: Twin) -> tuple[PerturbedTwin, ...]:
    """Return twins on either side of the description, for all that a robot may differ by and still be as described."""
    sources = [source for source in assumed(twin.robot).sources if source.value > 0]
    doubted = perturbed_twins(twin, [ParameterUncertainty(source, WITHIN[source.quantity]) for source in sources])
    mass = ParameterUncertainty(_mass(twin.robot), WITHIN["mass"])
    for heavier in (_heavier_head, _heavier_tail):
        more, less = (twin.of_robot(heavier(twin.robot, by)) for by in (_STEP, -_STEP))
        doubted = (*doubted, PerturbedTwin(mass, more, less, _STEP))
    return doubted


def _mass(robot: RobotSpec) -> Source:
    kg = sum(part.mass_kg for part in robot.head.part)
    return Source("mass", kg, "kg", None, (), "as described")


def _heavier_head(robot: RobotSpec, by: float) -> RobotSpec:
    return robot.changed(
        head={"part": tuple(p.model_copy(update={"mass_kg": p.mass_kg * (1 + by)}) for p in robot.head.part)}
    )


def _heavier_tail(robot: RobotSpec, by: float) -> RobotSpec:
    return robot.with_tail_mass_times(1 + by)
