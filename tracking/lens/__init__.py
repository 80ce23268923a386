"""The lens: calibrated from pictures of a board, undone in tracks, with parallax and what is doubtful about it."""

from tracking.lens.board import BoardSpec, load_board
from tracking.lens.board_scale import BoardScale, scale_from_board, scale_from_corners
from tracking.lens.calibrate import LensCalibration, View, calibrate_lens
from tracking.lens.camera_flags import lens_flags, save_camera
from tracking.lens.corners import Corners, find_corners
from tracking.lens.credibility import LensUncertainty
from tracking.lens.parallax import true_over_apparent
from tracking.lens.pictures import video_pictures
from tracking.lens.print_board import draw_board
from tracking.lens.undistort import camera_matrix, to_rays, undistort

__all__ = [
    "BoardScale",
    "BoardSpec",
    "Corners",
    "LensCalibration",
    "LensUncertainty",
    "View",
    "calibrate_lens",
    "camera_matrix",
    "draw_board",
    "find_corners",
    "lens_flags",
    "load_board",
    "save_camera",
    "scale_from_board",
    "scale_from_corners",
    "to_rays",
    "true_over_apparent",
    "undistort",
    "video_pictures",
]
