"""The pose a tail is released in, from where its markers are: a first guess for the fit of the decay."""

import numpy as np

from fitting.free_decay.decay_twin import DecayTwin

ANGLE_SD_RAD = 0.3  # of a hinge before the markers are seen: neighbours hold each other back
MARKER_SD_M = 0.003  # boxes sit some millimetres off their markers
_STEP = 1e-5


def start_pose(twin: DecayTwin, lateral_m: np.ndarray, rest_m: np.ndarray) -> np.ndarray:
    """(h,) hinge angles that put the markers where they are, most likely given how far hinges bend.

    Regularised Gauss-Newton on the kinematics alone.

    Args:
        twin: of the same k markers.
        lateral_m: (k,) in one frame; nan where missing.
        rest_m: (k,) of the straight tail.
    """
    straight = twin.markers_at(np.zeros(twin.hinges))[:, 1]
    seen = np.isfinite(lateral_m)
    wanted = np.where(seen, lateral_m - rest_m, 0.0)  # (k,)
    pose = np.zeros(twin.hinges)
    for _ in range(6):
        poses = np.concatenate([pose[None], pose + _STEP * np.eye(twin.hinges)])  # (1 + h, h)
        at = twin.markers_at(poses)[..., 1] - straight  # (1 + h, k)
        jacobian = np.where(seen, (at[1:] - at[0]) / _STEP, 0.0).T / MARKER_SD_M  # (k, h)
        residual = np.where(seen, wanted - at[0], 0.0) / MARKER_SD_M
        normal = jacobian.T @ jacobian + np.eye(twin.hinges) / ANGLE_SD_RAD**2
        pose = pose + np.linalg.solve(normal, jacobian.T @ residual - pose / ANGLE_SD_RAD**2)
    return np.clip(pose, -1.5, 1.5)
