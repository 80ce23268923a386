"""What a refitted twin leaves of gaits where nothing is wrong: how two simulators of one robot differ.

Measured between the twin and a second simulator over sessions of drawn water (`calib benchmark effects`), for the nine
published markers; of other markers it is taken to be as of the nearest of these along the body, each by itself. How
straight a fish goes is not among the numbers that the benchmark compares; what it leaves of that is `COURSE_SD`.
"""

from importlib.resources import files

import numpy as np
from scipy.linalg import block_diag

from fitting.posterior.gait import OF_A_MARKER, SPEED
from session import FISHSIM_MARKERS
from swimmer import RobotSpec

_OF_A_MARKER = 2 * OF_A_MARKER
COURSE_SD = (0.001, 0.001)
"""Of the speed sideways, m/s, and of the rate of turning, rad/s, where nothing is wrong."""


def with_course(covariance: np.ndarray) -> np.ndarray:
    """(g + 2, g + 2) the covariance (g, g) of one gait, its course with it."""
    return np.asarray(block_diag(covariance, np.diag(np.square(COURSE_SD))))


def discrepancy_for(markers: tuple[str, ...], robot: RobotSpec) -> np.ndarray:
    """(g, g) covariance of one gait of these markers, without its course."""
    with files("diagnosis").joinpath("discrepancy.npz").open("rb") as file, np.load(file) as stands:
        known = np.asarray(stands["covariance"], float)
    if markers == FISHSIM_MARKERS:
        return known
    published = [name for name in FISHSIM_MARKERS if name in robot.markers]
    along_m = robot.marker_positions_m(markers)[:, 0]
    if published:
        of_known = robot.marker_positions_m(tuple(published))[:, 0]
        near = [published[int(np.argmin(np.abs(of_known - x)))] for x in along_m]
        near = [own if own in published else other for own, other in zip(markers, near, strict=True)]
        nearest = [FISHSIM_MARKERS.index(name) for name in near]
    else:
        nearest = [round(i) for i in np.linspace(0, len(FISHSIM_MARKERS) - 1, len(markers))]
    parts = [np.arange(1 + _OF_A_MARKER * i, 1 + _OF_A_MARKER * (i + 1)) for i in nearest]
    wanted = np.concatenate([[SPEED], *parts])
    own = np.concatenate([[-1], np.repeat(np.arange(len(markers)), _OF_A_MARKER)])
    same = np.array([markers[i] in published for i in range(len(markers))])
    alone = (own[:, None] != own) & ~(same[own][:, None] & same[own] & (own[:, None] >= 0) & (own >= 0))
    alone &= ~((own[:, None] == -1) & same[own]) & ~((own == -1) & same[own][:, None])
    result = known[np.ix_(wanted, wanted)]
    result[alone] = 0.0
    return np.asarray(result)
