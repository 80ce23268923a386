"""Pool videos with known truth: rendered from the twin, for whoever measures a tracker."""

from benchmarks.video.clips import BENCHMARK_CLIPS
from benchmarks.video.motion import RobotPoints
from benchmarks.video.plan import ClipPlan, MarkerLook, Optics
from benchmarks.video.render import Encoding
from benchmarks.video.scene import PoolScene
from benchmarks.video.truth import ClipTruth, load_truth, truth_file

__all__ = [
    "BENCHMARK_CLIPS",
    "ClipPlan",
    "ClipTruth",
    "Encoding",
    "MarkerLook",
    "Optics",
    "PoolScene",
    "RobotPoints",
    "load_truth",
    "truth_file",
]
