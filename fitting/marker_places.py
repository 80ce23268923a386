"""Markers that sit elsewhere in one swim than in the others: a box on a wrong spot, a marker that slipped.

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

LEAST_M, LEAST = 0.022, 1.75
"""A marker is flagged that sits farther than this from where it sits in the others, in m and in standard deviations: in
the public trials the markers behind the head reach 20 mm and 1.9."""
BEYOND_OTHERS = 2.5
"""Nose and neck also this many times as far as the others differ among themselves: they set the scale, and in the
public trials their places scatter by 30 mm."""
_FEWEST = 3  # swims: of two nobody knows which is the odd one
_STIFF = 0.15  # the mean shape of a beat bends by this share of what a shape in one frame does
_SLIP = 0.06  # of the way from nose to neck, standard deviation of where a marker sits


def odd_markers(trials: Sequence[MeasuredTrial], robot: RobotSpec) -> dict[str, Flag]:
    """A flag for each swim, by its name, one of whose markers sits elsewhere than in the other swims."""
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
        farther = np.linalg.norm(offsets[place, worst]) > np.linalg.norm(usual[worst])  # than described
        if off_m[worst] > least_m[worst] and farther:
            found[trial.name] = _flag(trial, markers[worst], off_m[worst])
    return found


def _mean_shape(trial: MeasuredTrial, robot: RobotSpec) -> np.ndarray:
    """(2 m,) deviations of the mean shape from the described one, in the axes of the body, m."""
    prior = layout_model(*_layout(trial.markers, robot))
    return learned(prior, trial.position_m, trial.weight > 0).mean_px  # px of 1 m


def _gauge(markers: tuple[str, ...], robot: RobotSpec) -> JointGaussian:
    """What the mean shapes of two swims may differ by, but for place, heading and size of the body."""
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
