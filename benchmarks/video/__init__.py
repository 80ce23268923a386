"""Pool videos with known truth: rendered from the twin, for whoever measures a tracker."""

from benchmarks.video.camera import PX_PER_M, PoolCamera
from benchmarks.video.clips import BENCHMARK_CLIPS
from benchmarks.video.motion import Motion, RobotPoints, travelling_wave, twin_motion
from benchmarks.video.occlusion import Occlusion
from benchmarks.video.picture import Picture
from benchmarks.video.plan import ClipPlan, Look, MarkerLook, Optics, Swim
from benchmarks.video.render import ENCODINGS, Encoding, render_clip, render_encodings, write_scene
from benchmarks.video.scene import PoolScene
from benchmarks.video.stage import Stage, centred, staged
from benchmarks.video.truth import ClipTruth, boxes_file, load_truth, save_boxes, truth_file
from benchmarks.video.water import WaterLook
from benchmarks.video.writer import Codec, VideoWriter

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
