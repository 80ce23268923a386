import gzip
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from swimcal.errors import InputError
from swimcal.tracks import as_tracks, load_tracks, pixels_of, save_tracks, shared_frames
from tests.swimcal.sample import FISHSIM, MARKERS, made_tracks, needs_fishsim, tracks_text

HEADER = "time_s,nose_x,nose_y,neck_x,neck_y,tail_1_x,tail_1_y"


def written(tmp_path: Path, text: str | bytes, name: str = "t.csv") -> Path:
    path = tmp_path / name
    path.write_bytes(text.encode() if isinstance(text, str) else text)
    return path


def faults(path: Path, **options: int) -> str:
    with pytest.raises(InputError) as caught:
        load_tracks(path, MARKERS, 60.0, **options)
    return str(caught.value)


def test_headerless_rows_are_frames_at_the_nominal_rate(tmp_path: Path) -> None:
    tracks = load_tracks(written(tmp_path, tracks_text(4)), MARKERS, 50.0)
    assert pixels_of(tracks).shape == (4, 3, 2)
    np.testing.assert_allclose(tracks.time.values, [0, 0.02, 0.04, 0.06])
    np.testing.assert_array_equal(pixels_of(tracks)[2, 1], [42.0, 10.5])
    np.testing.assert_array_equal(tracks.confidence.values, 1.0)


def test_columns_come_in_any_order_and_confidence_is_optional(tmp_path: Path) -> None:
    text = (
        "neck_y,neck_x,nose_confidence,tail_1_x,tail_1_y,nose_x,nose_y,time_s\n4,3,0.5,5,6,1,2,0.1\n4,3,,5,6,1,2,0.3\n"
    )
    tracks = load_tracks(written(tmp_path, text), MARKERS, 60.0)
    np.testing.assert_array_equal(pixels_of(tracks)[0], [[1, 2], [3, 4], [5, 6]])
    np.testing.assert_array_equal(tracks.confidence.values, [[0.5, 1, 1], [1, 1, 1]])
    np.testing.assert_array_equal(tracks.time.values, [0.1, 0.3])


def test_empty_and_nan_cells_are_missing_samples(tmp_path: Path) -> None:
    tracks = load_tracks(written(tmp_path, "1,2,3,4,5,6\n,2,nan,NaN,5,6\n1,2,3,4,5,6\n"), MARKERS, 60.0)
    assert np.isnan(pixels_of(tracks)[1, :2]).all()
    np.testing.assert_array_equal(tracks.confidence.values[1], [0, 0, 1])


@pytest.mark.parametrize("name", ["t.csv", "t.csv.gz"])
def test_saved_tracks_read_back_the_same(tmp_path: Path, name: str) -> None:
    tracks = made_tracks()
    save_tracks(tmp_path / name, tracks)
    again = load_tracks(tmp_path / name, MARKERS, 1.0)
    np.testing.assert_array_equal(again.time.values, tracks.time.values)
    np.testing.assert_array_equal(pixels_of(again), pixels_of(tracks))
    np.testing.assert_array_equal(again.confidence.values, tracks.confidence.values)


def test_windows_line_ends_and_a_byte_order_mark_are_no_fault(tmp_path: Path) -> None:
    text = "\ufeff" + f"{HEADER}\n0,1,2,3,4,5,6\n0.02,1,2,3,4,5,6\n\n".replace("\n", "\r\n")
    assert len(load_tracks(written(tmp_path, text), MARKERS, 60.0).time.values) == 2


def test_tracks_are_labelled_and_have_units() -> None:
    tracks = made_tracks()
    assert tracks.position.dims == ("time", "space", "keypoint")
    assert (tracks.position.units, tracks.time.units) == ("px", "s")
    assert tracks.fps == pytest.approx(59.94)
    chosen = tracks.sel(keypoint=["tail_1", "nose"])
    np.testing.assert_array_equal(pixels_of(chosen), pixels_of(tracks)[:, [2, 0]])


def test_arrays_that_do_not_fit_each_other_are_refused() -> None:
    with pytest.raises(ValueError, match=r"expected \(2, 3, 2\) and \(2, 3\)"):
        as_tracks(MARKERS, np.zeros(2), np.zeros((3, 3, 2)), np.zeros((2, 3)))


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("1,2,3,4,5,6\n1,2,3\n1,2,3,4,5,6\n", "line 2: wrong number of columns; found 3 columns; expected 6"),
        ("1,2,3,4,5,6\n\n1,2,3,4,5,6\n", "line 2: wrong number of columns; found a blank line"),
        ("1,2,3,4,5,6\n1,2,x,4,5,6\n", "line 2, column 3 (neck_x): not a number; found 'x'"),
        ("1,2,3,4,5,6\n1,2,3,4,1_0,6\n", "line 2, column 5 (tail_1_x): not a number; found '1_0'"),
        ("1,2,3,4,5,6\n1,2,3,inf,5,6\n", "line 2, column 4 (neck_y): an infinite value; found 'inf'"),
        ("1,2,3,4\n1,2,3,4\n", "found 4 in every row; expected 6: x and y of the 3 markers nose,"),
        (",,,,,\n,2,3,,5,\n", "no marker is seen in any frame"),
        ("1,2,3,4,5,6\n", "too short; found 1 frames; expected at least 2"),
        ("", "the file is empty"),
        ("\n\n\n", "the file is empty"),
        ("1;2;3;4;5;6\n1;2;3;4;5;6\n", "expected columns separated by commas. Save it with commas"),
        (b"\x89PNG\r\n\x1a\n\x00\xff", "not a text file; found byte 0x89 at 0; expected text in UTF-8"),
        ("1,2\n1,2\n".encode("utf-16"), "expected text in UTF-8. Save it again as CSV in UTF-8."),
        ("Höhe,1\n".encode("latin-1"), "found byte 0xf6 at 1; expected text in UTF-8. Save it again as CSV in UTF-8."),
        (
            f"{HEADER}\ns,px,px,px,px,px,px\n0,1,2,3,4,5,6\n",
            "line 2: a row without a number; found 's, px",
        ),
        (gzip.compress(b"1,2,3,4,5,6\n" * 50, mtime=0)[:-9], "the packed file is damaged; found its end is missing"),
        (gzip.compress(b"1,2,3,4,5,6\n" * 50, mtime=0)[:12] + b"xx", "the packed file is damaged"),
        (f"{HEADER}\n0,1,2,3,4,5,6\n0,1,2,3,4,5,6\n", "line 3: time does not increase; found 0.0 after 0.0"),
        (f"{HEADER}\n0,1,2,3,4,5,6\n,1,2,3,4,5,6\n", "line 3: time_s is missing"),
        (f"{HEADER}\n", "the file is empty; found no frame; expected at least 2 frames. Write the recording"),
        (f"{HEADER},neck_confidnce\n", "unknown column; found 'neck_confidnce'"),
        (f"{HEADER},neck_confidnce\n", "Did you mean 'neck_confidence'?"),
        (
            f",{HEADER}\n",
            "marker of the session. Row numbers? Remove the column; `calib convert` does.",
        ),
        (f"{HEADER},paint\n", "Add its marker to [markers] names, or remove the column."),
        (f"{HEADER},neck_y\n", "column 'neck_y' is repeated; found 2 of it"),
        ("time_s,nose_x,nose_y,neck_x,neck_y,tail_1_x\n", "line 1: column 'tail_1_y' is missing"),
        (
            "hello\n",
            "t.csv: line 1: not a header of tracks; found 'hello'; expected the columns time_s, nose_x, nose_y … of "
            "nose, neck, tail_1, or rows of numbers alone",
        ),
        (
            f"{HEADER},nose_confidence\n0,1,2,3,4,5,6,1\n1,1,2,3,4,5,6,1.5\n",
            "line 3, column 8 (nose_confidence): confidence out of range; found 1.5; expected a number",
        ),
    ],
)
def test_faulty_tracks_are_reported_with_their_place(tmp_path: Path, text: str | bytes, message: str) -> None:
    path = written(tmp_path, text)
    said = faults(path)
    assert said.startswith(str(path))
    assert message in said


def test_confidences_in_percent_are_one_fault(tmp_path: Path) -> None:
    rows = "\n".join(f"{k / 60},{k},2,{90 + k},3,4,5,6" for k in range(5))
    header = HEADER.replace("nose_y", "nose_y,nose_confidence")
    with pytest.raises(InputError, match="They look like percent") as caught:
        load_tracks(written(tmp_path, f"{header}\n{rows}\n"), MARKERS, 60.0)
    assert len(caught.value.faults) == 1


def test_a_marker_that_is_never_seen_is_no_fault(tmp_path: Path) -> None:
    tracks = load_tracks(written(tmp_path, "1,2,,4,5,6\n1,2,3,,5,6\n"), MARKERS, 60.0)
    np.testing.assert_array_equal(tracks.confidence.values, [[1, 0, 1], [1, 0, 1]])


def test_tracks_without_any_sample_are_one_fault(tmp_path: Path) -> None:
    said = faults(written(tmp_path, f"{HEADER}\n0,,,,,,\n1,,,,,,\n"))
    assert said.count("no marker is seen in any frame") == 1


def test_absent_file_and_folder_are_reported(tmp_path: Path) -> None:
    assert "the file is not there" in faults(tmp_path / "none.csv")
    assert "this is a folder" in faults(tmp_path)


@needs_fishsim
def test_the_public_tracks_load_whole() -> None:
    markers = ("nose", "neck", "dorsal_fin", *(f"tail_{k}" for k in range(1, 6)), "caudal_fin")
    frames = {path.stem: len(load_tracks(path, markers, 60.0).time.values) for path in sorted(FISHSIM.glob("f*.csv"))}
    assert frames == {"f0_50": 541, "f0_75": 301, "f1_00": 301, "f1_25": 301, "f1_75": 301}


@given(first=st.integers(0, 60), count=st.integers(20, 40), gaps=st.integers(0, 5), own=st.integers(0, 15))
def test_frames_that_two_recordings_share_are_counted(first: int, count: int, gaps: int, own: int) -> None:
    random = np.random.default_rng(100 * first + count)
    whole_px = 500 + np.cumsum(random.normal(0, 9.0, (100, 3, 2)), axis=0)
    before_px = 3000 + np.cumsum(random.normal(0, 9.0, (own, 3, 2)), axis=0)
    cut_px = np.concatenate([before_px, whole_px[first : first + count] + random.normal(0, 0.3, (count, 3, 2))])
    lost = own + random.choice(count, gaps, replace=False)
    cut_px[lost, 1] = np.nan
    whole, cut, other = (
        as_tracks(MARKERS, np.arange(len(px)) / 60, px, np.isfinite(px[..., 0]).astype(float))
        for px in (whole_px, cut_px, whole_px[:30] + 5000.0)
    )

    assert shared_frames(whole, cut) == shared_frames(cut, whole) == count - gaps
    assert shared_frames(whole, other) == 0
