"""`calib convert`: tracks of other programs become the contract's and back; `calib new --synthetic --video`."""

from pathlib import Path

import numpy as np
import pytest

from swimcal.tracks import pixels_of
from tests.calib.door import Front, assert_reports
from tests.calib.filmed import read
from tracking.formats import FORMATS, export_tracks
from tracking.tracked import as_tracked


@pytest.mark.parametrize("form", FORMATS)
def test_tracks_of_every_form_become_the_contracts(
    calib: Front, filmed_session: Path, tmp_path: Path, form: str
) -> None:
    true = read(filmed_session / "truth" / "slow.csv")
    export_tracks(as_tracked(true), tmp_path / "theirs", form)
    outcome = calib("convert", tmp_path / "theirs", "--out", tmp_path / "ours.csv", "--fps", "30")

    assert outcome == (0, f"{tmp_path / 'ours.csv'}\n", "")
    ours = read(tmp_path / "ours.csv")
    np.testing.assert_allclose(pixels_of(ours), pixels_of(true), atol=1e-6)
    np.testing.assert_allclose(ours.time.values, true.time.values, atol=1e-5)


CASES: dict[str, tuple[tuple[str, ...], tuple[str, ...]]] = {
    "unknown form": (("--to", "sleap"), ("--to", "'sleap'", "swimcal, deeplabcut, movement")),
    "unknown marker": (("--markers", "nose,tail_9"), ("tail_9",)),
    "a marker twice": (("--markers", "nose,nose"), ("--markers", "each marker once")),
    "two at once": (("--fps", "nan", "--markers", ""), ("2 faults", "--fps", "above 0", "--markers")),
}


@pytest.mark.parametrize("case", CASES)
def test_what_cannot_be_converted_is_reported(calib: Front, filmed_session: Path, tmp_path: Path, case: str) -> None:
    arguments, parts = CASES[case]
    export_tracks(as_tracked(read(filmed_session / "truth" / "slow.csv")), tmp_path / "dlc.csv", "deeplabcut")

    assert_reports(calib("convert", tmp_path / "dlc.csv", "--out", tmp_path / "o.csv", *arguments), *parts)
    assert not (tmp_path / "o.csv").exists()


def test_a_file_of_another_width_is_reported(calib: Front, filmed_session: Path, tmp_path: Path) -> None:
    true = read(filmed_session / "truth" / "slow.csv")
    export_tracks(as_tracked(true), tmp_path / "f.csv", "fishsim")
    outcome = calib("convert", tmp_path / "f.csv", "--out", tmp_path / "o.csv", "--markers", "nose,neck")

    assert_reports(outcome, "f.csv", "18 in every row", "4: x and y of the 2 markers")


def test_a_packed_file_is_read_and_not_written(calib: Front, fresh_session: Path, tmp_path: Path) -> None:
    packed = fresh_session / "trials" / "slow.csv.gz"

    assert calib("convert", packed, "--out", tmp_path / "o.csv").code == 0
    assert_reports(calib("convert", packed, "--out", tmp_path / "o.csv.gz"), "without .gz")
