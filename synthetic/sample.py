"""Makes `datasets/sample` again: `python -m synthetic.sample datasets/sample`; `--video` adds a filmed trial."""

import shutil
import sys
import tempfile
from pathlib import Path

from synthetic.card import write_card
from synthetic.default import default_plan
from synthetic.filmed import SessionVideo
from synthetic.plan import SyntheticPlan, SyntheticTrial
from synthetic.session import make_session

SAMPLE_SEED = 0
COMMAND = "python -m synthetic.sample datasets/sample"
WHAT = """A synthetic session: marker tracks of the built-in 0.57 m fish at five speeds, two to fit and three
held out, with the errors of a real tracker and one track fault."""

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
WHAT_IS_FILMED = f"""
One more trial, `{FILMED.name}`, comes as a rendered video with the start boxes of its markers; what a perfect
tracker would find in it is in `truth/`."""


def sample_plan(*, filmed: bool = False) -> SyntheticPlan:
    """The default plan under the sample's name and seed, with one more trial where it is filmed."""
    plan = default_plan(SAMPLE_SEED)
    trials = (*plan.trials, FILMED) if filmed else plan.trials
    return plan.model_copy(update={"name": "sample", "trials": trials})


def make_sample(folder: Path, *, filmed: bool = False) -> Path:
    """Makes the sample and its card; files of the same names are replaced, no others are touched.

    Args:
        folder: of the sample.
        filmed: with one more trial, as a video; the other trials stay as they are.
    """
    with tempfile.TemporaryDirectory() as scratch:
        made = make_session(Path(scratch) / "sample", sample_plan(filmed=filmed), VIDEO if filmed else None)
        what, command = (WHAT + WHAT_IS_FILMED, f"{COMMAND} --video") if filmed else (WHAT, COMMAND)
        write_card(made, "Sample session", what, command)
        shutil.copytree(made, folder, dirs_exist_ok=True)
    return folder


if __name__ == "__main__":
    folders = [argument for argument in sys.argv[1:] if argument != "--video"]
    print(make_sample(Path(folders[0] if folders else "datasets/sample"), filmed="--video" in sys.argv))
