"""How far things may be off where nothing is wrong: boxes, markers, and the robot against its description."""

import numpy as np
from scipy.optimize import minimize

from diagnosis.constants import WITHIN
from fitting.model.features import of_markers
from fitting.model.session_model import NuisanceModel, PlacementUncertainty
from fitting.structure import ParameterUncertainty, PerturbedTwin, Source, assumed, perturbed_twins
from swimmer import RobotSpec, Twin

TAKEN = PlacementUncertainty(box_m=0.003, marker_m=0.001)
"""Before the trials are looked at: boxes a few pixels, markers as well as a ruler places them."""

_LN_SD = 0.7  # of either size
_ENDS_M = (1e-4, 0.05)
_STARTS = ((1.0, 1.0), (3.0, 1.0), (1.0, 10.0))  # times what is taken
_STEP = 0.05  # of mass, either way


def placement_uncertainty(
    residual: np.ndarray, trials: int, disturbances: NuisanceModel, observed: np.ndarray | None = None
) -> PlacementUncertainty:
    """Return the likeliest sizes.

    Args:
        residual: (k,) what is left of the features.
        trials: how many they are of.
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
    """(2 m t,) where a row of so many features, of length k, holds the means of its markers."""
    return of_markers(np.arange(length).reshape(trials, -1))[..., 0].ravel()


def perturbed_robots(twin: Twin) -> tuple[PerturbedTwin, ...]:
    """Twins on either side of the description, for all that a robot may differ by and still be as described."""
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
