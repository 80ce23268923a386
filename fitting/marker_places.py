"""Odd markers: those that sit elsewhere in one swim than in the others: a box on a wrong spot, a marker that slipped.

No description places a marker to better than some centimetres on a robot as built, and what is off in every swim is the
posterior's to tell (`markers_off` there). One swim against the others shows what is wrong with that swim.
"""

from collections.abc import Sequence

import numpy as np

from fitting.trial import MeasuredTrial
from session import Flag
from session.session_file import HEAD_MARKERS
from swimmer import RobotSpec
from tracking.quality.body_model import FREE_PX2, JointGaussian, layout_model, learned

LEAST_M = 0.022
"""A flagged marker sits at least so far from its place in the other swims: the public trials reach 20 mm."""
LEAST = 1.75
"""A flagged marker is off by at least so many standard deviations: the public trials reach 1.9."""
BEYOND_OTHERS = 2.5
"""Nose and neck must also be off by this many times the scatter of the other swims to be flagged.

They set the scale, and in the public trials their places scatter by 30 mm.
"""
_FEWEST = 3  # least number of swims: of two nobody knows which is the odd one
_STIFF = 0.15  # the mean shape of a beat bends by this share of what a shape in one frame does
_SLIP = 0.06  # standard deviation of a marker's place, relative to the distance from nose to neck


def odd_markers(trials: Sequence[MeasuredTrial], robot: RobotSpec) -> dict[str, Flag]:
    """Flag each swim, by its name, one of whose markers sits elsewhere than in the other swims.

    Args:
        trials: the swims.
        robot: the robot.
    """
    if len(trials) < _FEWEST:
        return {}
    markers = trials[0].markers
    gauge = _gauge(markers, robot)
    everyone = np.ones(len(markers), bool)
    apart = [gauge.leave_one_out(_mean_shape(trial, robot), everyone) for trial in trials]
    offsets, spread = np.array([each for each, _ in apart]), apart[0][1]  # (t, m, 2), (m,) m
    of_head = np.isin(markers, HEAD_MARKERS)
    found = {}
    for place, trial in enumerate(trials):
        others = np.delete(offsets, place, axis=0)
        usual = np.median(others, axis=0)  # (m, 2)
        off_m = np.linalg.norm(offsets[place] - usual, axis=1)
        scatter_m = of_head * np.linalg.norm(others - usual, axis=2).max(axis=0)
        least_m = np.maximum(np.maximum(LEAST_M, LEAST * spread), BEYOND_OTHERS * scatter_m)  # (m,)
        worst = int(np.argmax(off_m / spread))
        farther = np.linalg.norm(offsets[place, worst]) > np.linalg.norm(usual[worst])  # farther than described
        if off_m[worst] > least_m[worst] and farther:
            found[trial.name] = _flag(trial, markers[worst], off_m[worst])
    return found


def _mean_shape(trial: MeasuredTrial, robot: RobotSpec) -> np.ndarray:
    """Return the deviations (2 m,) of the mean shape from the described one, in the axes of the body, m."""
    prior = layout_model(*_layout(trial.markers, robot))
    return learned(prior, trial.position_m, trial.weight > 0).mean_px  # px of 1 m


def _gauge(markers: tuple[str, ...], robot: RobotSpec) -> JointGaussian:
    """Return the joint distribution of the differences of two swims' mean shapes.

    They are free in place, heading and size.
    """
    layout = layout_model(*_layout(markers, robot))
    bends = _STIFF**2 * layout.covariance_px2
    slips = (_SLIP * robot.scale_length_m) ** 2 * np.eye(len(bends))
    return JointGaussian(bends + slips + FREE_PX2 * layout.moves @ layout.moves.T)


def _layout(markers: tuple[str, ...], robot: RobotSpec) -> tuple[np.ndarray, float, float, float]:
    root_x_m = max(marker.position_m[0] for marker in robot.markers.values() if marker.body == "head")
    return robot.marker_positions_m(markers), root_x_m, 1.0, robot.scale_length_m


def _flag(trial: MeasuredTrial, marker: str, off_m: float) -> Flag:
    message = (
        f"{marker} sits {1000 * off_m:.0f} mm from its place in the other swims, in the whole of {trial.name}: is its "
        "box on the marker, did it slip? The trial counts as it is"
    )
    first = trial.first_frame
    return Flag("markers_off", (marker,), (first, first + len(trial.time_s) - 1), message)
