"""Pool videos with known truth: rendered from the twin, for whoever measures a tracker."""

from synthetic.video.camera import PX_PER_M, PoolCamera
from synthetic.video.clips import BENCHMARK_CLIPS
from synthetic.video.motion import Motion, RobotPoints, travelling_wave, twin_motion
from synthetic.video.occlusion import Occlusion
from synthetic.video.picture import Picture
from synthetic.video.plan import ClipPlan, Look, MarkerLook, Optics, Swim
from synthetic.video.render import ENCODINGS, Encoding, render_clip, render_encodings, write_scene
from synthetic.video.scene import PoolScene
from synthetic.video.stage import Stage, centred, staged
from synthetic.video.truth import ClipTruth, boxes_file, load_truth, save_boxes, truth_file
from synthetic.video.water import WaterLook
from synthetic.video.writer import Codec, VideoWriter

__all__ = [
    "BENCHMARK_CLIPS",
    "ENCODINGS",
    "PX_PER_M",
    "ClipPlan",
    "ClipTruth",
    "Codec",
    "Encoding",
    "Look",
    "MarkerLook",
    "Motion",
    "Occlusion",
    "Optics",
    "Picture",
    "PoolCamera",
    "PoolScene",
    "RobotPoints",
    "Stage",
    "Swim",
    "VideoWriter",
    "WaterLook",
    "boxes_file",
    "centred",
    "load_truth",
    "render_clip",
    "render_encodings",
    "save_boxes",
    "staged",
    "travelling_wave",
    "truth_file",
    "twin_motion",
    "write_scene",
]
