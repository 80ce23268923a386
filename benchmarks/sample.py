"""Makes `datasets/sample` again, with the checksums of its card: `python -m benchmarks.sample datasets/sample`."""

import shutil
import sys
import tempfile
from pathlib import Path

from benchmarks.video.filmed import SessionVideo
from session.results import sha256_of, write_whole
from synthetic.default import default_plan
from synthetic.plan import SyntheticPlan
from synthetic.session import make_session
from synthetic.trials import SyntheticTrial

SAMPLE_SEED = 0
CARD_FILE = "CARD.md"
_TABLE = "|---|---|\n"  # that the checksums end the card with

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
    """Makes the sample; files of the same names are replaced, no others are touched."""
    with tempfile.TemporaryDirectory() as scratch:
        made = make_session(Path(scratch) / "sample", sample_plan(), VIDEO)
        shutil.copytree(made, folder, dirs_exist_ok=True)
    return folder


def checksums(folder: Path) -> dict[str, str]:
    """The sha256 of every file of a dataset by its name in the folder, without results and the card."""
    files = {path.relative_to(folder): path for path in sorted(folder.rglob("*")) if path.is_file()}
    own = {name: path for name, path in files.items() if "results" not in name.parts and name.name[0] != "."}
    return {name.as_posix(): sha256_of(path) for name, path in own.items() if name != Path(CARD_FILE)}


def write_checksums(folder: Path) -> None:
    """Writes them into the card, whose text is written by hand."""
    text, _, _ = (folder / CARD_FILE).read_text(encoding="utf-8").rpartition(_TABLE)
    rows = "".join(f"| `{name}` | `{digest}` |\n" for name, digest in checksums(folder).items())
    write_whole(folder / CARD_FILE, text + _TABLE + rows)


if __name__ == "__main__":
    write_checksums(make_sample(Path(sys.argv[1] if len(sys.argv) > 1 else "datasets/sample")))
