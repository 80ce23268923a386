"""Makes `datasets/sample` again: `python -m synthetic.sample datasets/sample`."""

import shutil
import sys
import tempfile
from pathlib import Path

from synthetic.card import write_card
from synthetic.default import default_plan
from synthetic.plan import SyntheticPlan
from synthetic.session import make_session

SAMPLE_SEED = 0
COMMAND = "python -m synthetic.sample datasets/sample"
WHAT = """A synthetic session: marker tracks of the built-in 0.57 m fish at five speeds, two to fit and three
held out, with the errors of a real tracker and one track fault."""


def sample_plan() -> SyntheticPlan:
    """The default plan under the sample's name and seed."""
    return default_plan(SAMPLE_SEED).model_copy(update={"name": "sample"})


def make_sample(folder: Path) -> Path:
    """Makes the sample and its card; files of the same names are replaced, no others are touched."""
    with tempfile.TemporaryDirectory() as scratch:
        made = make_session(Path(scratch) / "sample", sample_plan())
        write_card(made, "Sample session", WHAT, COMMAND)
        shutil.copytree(made, folder, dirs_exist_ok=True)
    return folder


if __name__ == "__main__":
    print(make_sample(Path(sys.argv[1] if len(sys.argv) > 1 else "datasets/sample")))
