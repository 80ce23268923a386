"""The lens: calibrated from pictures of a board, undone in tracks, with parallax and what is doubtful about it."""

from tracking.lens.board import BoardSpec, load_board
from tracking.lens.board_scale import BoardScale, scale_from_board
from tracking.lens.calibrate import LensCalibration, calibrate_lens
from tracking.lens.camera_flags import lens_flags, save_camera
from tracking.lens.pictures import video_pictures
from tracking.lens.print_board import draw_board

__all__ = [
    "BoardScale",
    "BoardSpec",
    "LensCalibration",
    "calibrate_lens",
    "draw_board",
    "lens_flags",
    "load_board",
    "save_camera",
    "scale_from_board",
    "video_pictures",
]
