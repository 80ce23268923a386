"""Makes `datasets/sample` again: `python -m benchmarks.sample datasets/sample`."""

import shutil
import sys
import tempfile
from pathlib import Path

from benchmarks.sample_card import write_card
from benchmarks.video.filmed import SessionVideo
from synthetic.default import default_plan
from synthetic.plan import SyntheticPlan
from synthetic.session import make_session
from synthetic.trials import SyntheticTrial

SAMPLE_SEED = 0
COMMAND = "python -m benchmarks.sample datasets/sample"
WHAT = """A synthetic session of the built-in 0.57 m fish: marker tracks at five speeds with the errors of a real
tracker and one track fault, and one swim as a rendered video with the start boxes of its markers; what a perfect
tracker would find in the video is in `truth/`. Two of the tracks are to fit; the others and the video are held out.
Beside them the experiments in air: two dry runs with the log of the motor, and three free decays of the tail."""

FILMED = SyntheticTrial(
    name="f1_00_video",
    frequency_hz=0.98,
    commanded_hz=1.0,
    seconds=3.5,
    role="holdout",
    phase_rad=0.7,
    heading_rad=3.0,
)
"""The sample's one video: a swim that stays within 1280 x 720 px at the scale of the published videos."""
VIDEO = SessionVideo(trials=(FILMED.name,), width_px=1280, height_px=720, crf=21)


def sample_plan() -> SyntheticPlan:
    """The default plan under the sample's name and seed, with one more trial, the filmed one."""
    plan = default_plan(SAMPLE_SEED)
    return plan.model_copy(update={"name": "sample", "trials": (*plan.trials, FILMED)})


def make_sample(folder: Path) -> Path:
    """Makes the sample and its card; files of the same names are replaced, no others are touched."""
    with tempfile.TemporaryDirectory() as scratch:
        made = make_session(Path(scratch) / "sample", sample_plan(), VIDEO)
        write_card(made, "Sample session", WHAT, COMMAND)
        shutil.copytree(made, folder, dirs_exist_ok=True)
    return folder


if __name__ == "__main__":
    print(make_sample(Path(sys.argv[1] if len(sys.argv) > 1 else "datasets/sample")))
