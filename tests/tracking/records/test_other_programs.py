"""Files of other programs: read as they are written, or named for what they are."""

from pathlib import Path

import h5py
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from swimcal.errors import FaultCollector, InputError
from swimcal.tracks import as_tracks, load_tracks, pixels_of
from tests.cases import few
from tests.tracking.records.trials import mixed_trial
from tracking.foreign import even_times, with_even_clock
from tracking.formats import from_movement, import_tracks, to_movement

MARKERS = ("nose", "neck", "tail_1")
PLACES = np.arange(30 * 6, dtype=float).reshape(30, 3, 2) % 97 + [[[10, 20], [40, 20], [80, 25]]]


def table(path: Path, head: list[str], times: list[str], separator: str = ",", above: str = "") -> Path:
    rows = [[time, *(f"{value:.3f}" for value in row.ravel())] for time, row in zip(times, PLACES, strict=True)]
    path.write_text(above + "\n".join(separator.join(row) for row in [head, *rows]) + "\n")
    return path


def head(first: str, form: str = "{}_{}") -> list[str]:
    return [first, *(form.format(marker, axis) for marker in MARKERS for axis in "xy")]


SECONDS = [f"{k / 60:.6f}" for k in range(30)]
COUNTED = [str(k) for k in range(30)]
UNKNOWN = "column '{}' has no known name, but grows.*time_s, time_ms or frame"


@pytest.mark.parametrize(
    ("name", "times", "form"),
    [
        ("time_s", SECONDS, "{}_{}"),
        ("time", SECONDS, "{}.{}"),
        ("Time (s)", SECONDS, "{} {}"),
        ("time_ms", [f"{1000 * k / 60:.3f}" for k in range(30)], "{}_{}"),
        ("time_s", [f"{k / 60:.2f}" for k in range(30)], "{}_{}"),
    ],
)
def test_times_by_other_names_units_and_roundings_are_the_same(
    tmp_path: Path, name: str, times: list[str], form: str
) -> None:
    tracks = import_tracks(table(tmp_path / "t.csv", head(name, form), times), MARKERS)
    assert tracks.time.values == pytest.approx(np.arange(30) / 60, abs=5e-4)
    assert tracks.fps == pytest.approx(60, rel=1e-3)
    np.testing.assert_allclose(pixels_of(tracks), PLACES)


def test_a_header_without_rows_is_refused_in_our_words(tmp_path: Path) -> None:
    (tmp_path / "t.csv").write_text(",".join(head("Zeit")) + "\n")
    with pytest.raises(InputError):
        import_tracks(tmp_path / "t.csv", MARKERS, fps=60.0)


def test_other_columns_beside_no_time_or_a_known_one_are_passed_over(tmp_path: Path) -> None:
    noise = [f"{np.sin(k):.3f}" for k in range(30)]
    tracks = import_tracks(table(tmp_path / "t.csv", head("heading"), noise), MARKERS, fps=60.0)
    np.testing.assert_allclose(pixels_of(tracks), PLACES)
    both = [f"{time},{k}" for k, time in enumerate(SECONDS)]
    tracks = import_tracks(table(tmp_path / "t.csv", head("time_s,count"), both), MARKERS)
    assert tracks.fps == pytest.approx(60, rel=1e-3)


@pytest.mark.parametrize("first", ["time_s,", ""])
def test_a_separator_at_the_end_of_each_row_makes_no_column(tmp_path: Path, first: str) -> None:
    lines = [[*first.split(",")[:-1], *head("")[1:], ""]]
    lines += [
        [*([time] if first else []), *map(str, row.ravel()), ""] for time, row in zip(SECONDS, PLACES, strict=True)
    ]
    (tmp_path / "t.csv").write_text("\n".join(map(",".join, lines)) + "\n")
    tracks = import_tracks(tmp_path / "t.csv", MARKERS, fps=60.0)
    np.testing.assert_allclose(pixels_of(tracks), PLACES)


@pytest.mark.parametrize("separator", [";", "\t", " "])
def test_other_separators_and_a_comment_above_are_read(tmp_path: Path, separator: str) -> None:
    file = table(tmp_path / "t.txt", head("time_s"), SECONDS, separator, "# exported\n")
    np.testing.assert_allclose(pixels_of(import_tracks(file, MARKERS)), PLACES)


def test_an_index_of_pandas_and_missing_words_are_read(tmp_path: Path) -> None:
    file = table(tmp_path / "t.csv", head("time_s"), SECONDS)
    lines = [f"{k - 1 if k else ''},{line}" for k, line in enumerate(file.read_text().splitlines())]
    lines[5] = ",".join([*lines[5].split(",")[:2], *["NA"] * 6])
    file.write_text("\n".join(lines))
    missing = np.isnan(pixels_of(import_tracks(file, MARKERS))).all(axis=(1, 2))
    assert np.flatnonzero(missing).tolist() == [4]


@pytest.mark.parametrize(
    ("name", "times", "fps", "what"),
    [
        ("frame", COUNTED, None, "the file has no time; .* `--fps 60`"),
        ("time_s", COUNTED, None, "the times are not in seconds.* numbers of frames.*`--fps 60`"),
        ("time_s", [f"{1000 * k / 60:.3f}" for k in range(30)], None, "not in seconds; .*They look like milliseconds"),
        ("time_ms", SECONDS, None, "column 'time_ms' is not in milliseconds; .*name the column time_s"),
        ("time_us", [f"{20000 * k}" for k in range(30)], 60.0, UNKNOWN.format("time_us")),
        ("Zeit", SECONDS, 60.0, UNKNOWN.format("Zeit")),
        ("frame#", [f"{k + k // 6}" for k in range(30)], 60.0, UNKNOWN.format("frame#")),
        ("elapsed", [f"{(k - k % 2 * (k > 20)) / 60:.4f}" for k in range(30)], 60.0, UNKNOWN.format("elapsed")),
        ("frame", SECONDS, 60.0, r"does not count frames; found 0\.016667.*name it time_s or time_ms"),
        ("", SECONDS, 60.0, r"does not count frames; found 0\.016667.*name it time_s or time_ms"),
        ("frame", [*COUNTED[:29], "28"], 60.0, "line 31: frames do not go on; found 28; expected after 28"),
    ],
)
def test_a_clock_is_asked_for_and_never_guessed_nor_passed_over(
    tmp_path: Path, name: str, times: list[str], fps: float | None, what: str
) -> None:
    with pytest.raises(InputError, match=what):
        import_tracks(table(tmp_path / "t.csv", head(name), times), MARKERS, fps)


def test_a_wrong_rate_does_not_bend_coarse_times() -> None:
    stamps = np.round(np.arange(60) * 0.02, 2)
    np.testing.assert_array_equal(even_times(stamps, 60.0, "f"), stamps)


def test_coarse_times_with_frames_left_out_ask_for_the_rate() -> None:
    frames = np.flatnonzero(np.random.default_rng(0).random(90) < 0.6)
    stamps = np.round(frames / 60, 2)
    with pytest.raises(InputError, match="too coarse to tell the frame rate"):
        even_times(stamps, None, "f")
    np.testing.assert_allclose(even_times(stamps, 60.0, "f") - stamps[0], (frames - frames[0]) / 60)


@few(10)
@given(
    fps=st.floats(25.0, 120.0),
    hz=st.floats(0.5, 2.0),
    uneven=st.sampled_from([0.2, 0.5]),
    jump_s=st.sampled_from([0.0, 1.0]),
    true=st.booleans(),
    seed=st.integers(0, 99),
)
def test_stamps_that_are_uneven_are_made_even_where_the_motion_is(
    fps: float, hz: float, uneven: float, jump_s: float, true: bool, seed: int
) -> None:
    random = np.random.default_rng(seed)
    even_s = np.arange(round(6 * fps)) / fps
    stamps_s = np.sort(even_s + random.normal(0, uneven / fps, len(even_s))) + jump_s * (even_s > 3.0)
    taken_s = stamps_s if true else even_s
    tail = 30 * np.sin(2 * np.pi * hz * taken_s[:, None] - np.arange(3)) * [0.2, 0.5, 1.0]
    along = np.array([0.0, 60.0, 120.0]) + 80 * taken_s[:, None]
    position_px = np.stack([along, tail], axis=-1) + random.normal(0, 0.2, (len(even_s), 3, 2))
    position_px[random.random((len(even_s), 3)) < 0.02] = np.nan
    tracks = as_tracks(MARKERS, stamps_s, position_px, np.isfinite(position_px[..., 0]).astype(float))
    found, flags = with_even_clock(tracks)

    assert bool(flags) != true
    assert np.array_equal(found.time.values, stamps_s) == true
    if not true:
        assert found.fps == pytest.approx(fps, rel=5e-3)
        assert np.abs(found.time.values - even_s - jump_s / 2).max() <= jump_s / 2 + 2 * uneven / fps


def test_sleap_is_read_with_frames_without_an_animal_as_missing(tmp_path: Path) -> None:
    columns = [f"{marker}.{what}" for marker in MARKERS for what in ("x", "y", "score")]
    lines = [",".join(["track", "frame_idx", "instance.score", *columns])]
    for k in (2, 3, 6):
        cells = [f"{v:.2f}" for place in PLACES[k] for v in (*place, 1.05)]
        lines.append(",".join(["track_0", str(k), "7.1", *cells]))
    (tmp_path / "t.csv").write_text("\n".join(lines))
    tracks = import_tracks(tmp_path / "t.csv", MARKERS, 50.0)
    assert tracks.time.values == pytest.approx(np.arange(2, 7) / 50)
    assert np.isnan(pixels_of(tracks)[2:4]).all()
    np.testing.assert_allclose(pixels_of(tracks)[[0, 1, 4]], PLACES[[2, 3, 6]])
    assert tracks.confidence.values[0].tolist() == [1, 1, 1]


def test_other_names_are_one_fault_with_both_lists_and_can_be_renamed(tmp_path: Path) -> None:
    file = table(tmp_path / "t.csv", ["time_s", "a_x", "a_y", "b_x", "b_y", "c_x", "c_y"], SECONDS)
    with pytest.raises(InputError) as raised:
        import_tracks(file, MARKERS)
    (fault,) = raised.value.faults
    assert (fault.found, fault.expected) == ("a, b, c", "nose, neck, tail_1")
    assert "--rename a=nose" in fault.next_step
    with pytest.raises(InputError, match="no marker neck; found nose, b, tail_1; expected nose, neck, tail_1"):
        import_tracks(file, MARKERS, rename={"a": "nose", "c": "tail_1"})
    tracks = import_tracks(file, MARKERS, rename={"a": "nose", "b": "neck", "c": "tail_1"})
    np.testing.assert_allclose(pixels_of(tracks), PLACES)
    with pytest.raises(InputError, match="no such name in the file to rename; found d"):
        import_tracks(file, MARKERS, rename={"d": "nose"})


def test_names_in_other_letters_are_paired_by_what_they_say(tmp_path: Path) -> None:
    titled = [
        name.replace("neck", "Neck").replace("nose", "NOSE").replace("tail_1", "Tail 1") for name in head("time_s")
    ]
    with pytest.raises(InputError, match="--rename 'NOSE=nose,Neck=neck,Tail 1=tail_1'`"):
        import_tracks(table(tmp_path / "t.csv", titled, SECONDS), MARKERS)


def test_places_in_metres_are_asked_about(tmp_path: Path) -> None:
    rows = [",".join([time, *map(str, (row / 950).ravel())]) for time, row in zip(SECONDS, PLACES, strict=True)]
    (tmp_path / "t.csv").write_text("\n".join([",".join(head("time_s")), *rows]))
    with pytest.raises(InputError, match=r"not in pixels; .* Are these metres"):
        import_tracks(tmp_path / "t.csv", MARKERS)


def test_movement_is_read_in_any_order_spelling_and_version(tmp_path: Path) -> None:
    data = to_movement(mixed_trial(1)).drop_vars(["state", "size"])
    older = data.rename({"keypoint": "keypoints", "individual": "individuals"})
    older = older.transpose("individuals", "keypoints", "space", "time")
    older.isel(space=[1, 0]).to_netcdf(tmp_path / "three.nc", engine="scipy")
    for found in (
        import_tracks(tmp_path / "three.nc", MARKERS),
        from_movement(data.isel(individual=0), "memory").tracks(MARKERS, None, FaultCollector("memory")),
    ):
        np.testing.assert_array_equal(pixels_of(found), pixels_of(mixed_trial(1)))


@pytest.mark.parametrize("unit", ["ms", "ns"])
def test_movement_is_read_with_durations_as_times(tmp_path: Path, unit: str) -> None:
    data = to_movement(mixed_trial(1)).drop_vars(["state", "size"])
    ticks = np.round(data.time.values * 1e9).astype("timedelta64[ns]").astype(f"timedelta64[{unit}]")
    data.assign_coords(time=ticks).to_netcdf(tmp_path / "t.nc", engine="h5netcdf")
    np.testing.assert_allclose(import_tracks(tmp_path / "t.nc", MARKERS).time, mixed_trial(1).time, atol=1e-3)


C3D = bytes([2, 80]) + bytes(600)


@pytest.mark.parametrize(
    ("name", "content", "what"),
    [
        ("t.slp", ("pred_points", "instances"), "a project of SLEAP"),
        ("t.h5", ("tracks", "node_names", "track_occupancy"), "SLEAP's analysis in HDF5"),
        ("t.h5", ("df_with_missing/table",), "DeepLabCut's HDF5"),
        ("t.c3d", C3D, "C3D"),
        ("t.trk", b'<?xml?>\n<object class="org.opensourcephysics.x"/>', "Tracker"),
        ("t.xlsx", b"PK\x03\x04....", "Excel"),
        ("t.mp4", b"\x00\x00\x00\x20ftypisom", "a video.*--videos"),
        ("t.json", b'{"a": 1}', "JSON"),
        ("t.csv", b"LABEL,ID,TRACK_ID,QUALITY,POSITION_X,POSITION_Y\nLabel,Spot ID,Track ID,Quality,X\n", "TrackMate"),
        ("t.csv", b"Label,Spot ID,Track ID,Quality,X,Y\n", "TrackMate"),
        ("t.csv", b'"Number of header lines:";"6"\n"Experiment";"pool"\n', "EthoVision"),
        ("t.csv", b"NO_OF_FRAMES\t301\nNO_OF_CAMERAS\t8\n", "motion capture"),
        ("t.csv", b"Format Version,1.23,Take Name,one\n", "motion capture"),
        ("t.csv", b"%time,field.header.seq,field.x\n1,2,3\n", "ROS"),
        ("t.csv", b"<KinoveaVideoAnalysis>", "Kinovea"),
        ("t.csv", b"PathFileType\t4\t(X/Y/Z)\n", "TRC"),
    ],
)
def test_files_that_cannot_be_read_are_named_with_the_way_that_works(
    tmp_path: Path, name: str, content: tuple[str, ...] | bytes, what: str
) -> None:
    if isinstance(content, bytes):
        (tmp_path / name).write_bytes(content)
    else:
        with h5py.File(tmp_path / name, "w") as file:
            for each in content:
                file[each] = np.zeros(3)
    with pytest.raises(InputError, match=f"this is .*{what}") as raised:
        import_tracks(tmp_path / name, MARKERS, 60.0)
    assert raised.value.faults[0].next_step


def test_labels_of_deeplabcut_are_no_tracks(tmp_path: Path) -> None:
    text = "scorer,me,me\nbodyparts,nose,nose\ncoords,x,y\nlabeled-data/v/img01.png,1,2\nlabeled-data/v/img09.png,1,2\n"
    (tmp_path / "CollectedData_me.csv").write_text(text)
    with pytest.raises(InputError, match="labels of single pictures, not tracks of a video; found 2 pictures"):
        import_tracks(tmp_path / "CollectedData_me.csv", ("nose",), 60.0)


def test_a_header_in_a_comment_names_the_columns(tmp_path: Path) -> None:
    turned = head("")[1:][::-1]
    path = tmp_path / "t.csv"
    np.savetxt(path, PLACES.reshape(30, -1)[:, ::-1], delimiter=",", header=",".join(turned))
    np.testing.assert_array_equal(pixels_of(import_tracks(path, MARKERS, 60.0)), PLACES)


@pytest.mark.parametrize("first", ["#", "#frame", "%frame"])
def test_so_does_one_whose_first_name_is_a_comment(tmp_path: Path, first: str) -> None:
    file = table(tmp_path / "t.csv", head(first), COUNTED)
    np.testing.assert_array_equal(pixels_of(import_tracks(file, MARKERS, 60.0)), PLACES.round(3))


@pytest.mark.parametrize(
    ("more", "cells", "message"),
    [
        (["nose_z", "neck_z", "tail_1_z"], ["0.5"] * 3, "places in space, in three coordinates; found z of nose, neck"),
        (["nose_occluded"], ["0", "1"], "column 'nose_occluded' has no known name.*name it nose_confidence"),
        (["tail_1_occluded"], ["0", "1"], "column 'tail_1_occluded' has no known name.*name it tail_1_confidence"),
        (["Likelihood"], ["0.9", "0.2"], "column 'Likelihood' has no known name"),
        (["id"], ["0", "1"], "several animals in column 'id'; found 0, 1"),
        (["individual"], ["anna", "bea"], "several animals in column 'individual'; found anna, bea"),
    ],
)
def test_columns_that_change_what_is_read_are_asked_about(
    tmp_path: Path, more: list[str], cells: list[str], message: str
) -> None:
    lines = table(tmp_path / "t.csv", head("time_s"), SECONDS).read_text().splitlines()
    wide = len(more) > 1
    rows = [f"{line},{','.join(cells) if wide else cells[k % len(cells)]}" for k, line in enumerate(lines[1:])]
    (tmp_path / "t.csv").write_text("\n".join([f"{lines[0]},{','.join(more)}", *rows, ""]))
    with pytest.raises(InputError, match=message):
        import_tracks(tmp_path / "t.csv", MARKERS)


@pytest.mark.parametrize("name", ["p", "c", "lik", "visible", "Prob"])
def test_a_confidence_may_have_a_short_name(tmp_path: Path, name: str) -> None:
    lines = table(tmp_path / "t.csv", head("time_s"), SECONDS).read_text().splitlines()
    rows = [f"{line},{0 if k < 5 else 1}" for k, line in enumerate(lines[1:])]
    (tmp_path / "t.csv").write_text("\n".join([f"{lines[0]},nose_{name}", *rows, ""]))
    confidence = import_tracks(tmp_path / "t.csv", MARKERS).confidence.values
    np.testing.assert_array_equal(confidence[:, 0], [0] * 5 + [1] * 25)
    assert (confidence[:, 1:] == 1).all()


@pytest.mark.parametrize("form", ["{}", "{}.0"])
def test_a_first_row_that_numbers_the_columns_is_no_frame(tmp_path: Path, form: str) -> None:
    names = [form.format(k) for k in range(7)]
    file = table(tmp_path / "t.csv", names[1:], ["0"] * 30)
    rows = [line.split(",", 1)[1] for line in file.read_text().splitlines()[1:]]
    file.write_text("\n".join([",".join(names[:6]), *rows, ""]))
    with pytest.raises(InputError, match="line 1: the first row numbers the columns"):
        import_tracks(file, MARKERS, 60.0)


@pytest.mark.parametrize("axis", [0, 1])
def test_places_beside_every_picture_are_refused(tmp_path: Path, axis: int) -> None:
    away = PLACES - 500 * np.eye(2)[axis]
    path = tmp_path / "t.csv"
    np.savetxt(path, away.reshape(30, -1), delimiter=",", header=",".join(head("")[1:]), comments="")
    with pytest.raises(InputError, match=f"{'xy'[axis]} is negative, where no picture is"):
        import_tracks(path, MARKERS, 60.0)


@pytest.mark.parametrize("ends", [",", "\n" + "," * 6 + "\n" + "," * 6, ""])
def test_what_a_sheet_leaves_at_the_ends_counts_nothing(tmp_path: Path, ends: str) -> None:
    lines = table(tmp_path / "t.csv", head("time_s"), SECONDS).read_text().splitlines()
    if ends == ",":
        text = "\n".join(f"{line.split(',', 1)[1]}," for line in lines[1:])
    elif ends:
        text = "\n".join(lines) + ends
    else:
        text = "sep=,\n" + "\n".join(
            ",".join(f'"{cell}"'.replace(".", ",") for cell in line.split(",")) for line in lines
        )
    (tmp_path / "t.csv").write_text(text)
    np.testing.assert_array_equal(pixels_of(import_tracks(tmp_path / "t.csv", MARKERS, 60.0)), PLACES.round(3))


@pytest.mark.parametrize("fps", ["None", "60 Hz", [60.0, 60.0]])
def test_a_frame_rate_of_movement_that_is_none_is_passed_over(fps: object) -> None:
    data = to_movement(mixed_trial(3)).assign_attrs(fps=fps)
    found = from_movement(data, "memory")
    assert found.time_s is not None


@pytest.mark.parametrize("change", ["unit", "space", "confidence"])
def test_places_of_movement_that_are_no_pixels_are_refused(change: str) -> None:
    data = to_movement(mixed_trial(3))
    if change == "confidence":
        data = data.assign(confidence=data.confidence.isel(keypoint=0, drop=True))
        assert np.isnan(from_movement(data, "memory").confidence).all()
        return
    if change == "unit":
        data.position.attrs["space_unit"] = "mm"
    else:
        data = data.reindex(space=["x", "y", "z"], fill_value=0.0)
    with pytest.raises(InputError, match="found the unit mm" if change == "unit" else "places in space"):
        from_movement(data, "memory")


@pytest.mark.parametrize("separator", [",", ";"])
def test_lines_of_settings_above_a_table_are_passed_over(tmp_path: Path, separator: str) -> None:
    above = f"Camera: GoPro 11\nfps{separator}60\n\n"
    file = table(tmp_path / "t.csv", head("time_s"), SECONDS, separator, above)
    np.testing.assert_allclose(pixels_of(import_tracks(file, MARKERS)), PLACES)


@pytest.mark.parametrize(
    ("separator", "form"), [(",", '"{:,.0f}"'), (",", '"{:,.2f}"'), ("\t", "{:,.0f}"), (";", "{:,.0f}")]
)
def test_numbers_whose_thousands_are_kept_apart_are_refused(tmp_path: Path, separator: str, form: str) -> None:
    rows = [separator.join(map(form.format, (row + 950).ravel())) for row in PLACES]
    text = "\n".join([separator.join(head("")[1:]), *rows])
    (tmp_path / "t.csv").write_text(text.replace(",", ".") if separator == ";" else text)
    with pytest.raises(InputError, match=r"thousands .* kept apart"):
        import_tracks(tmp_path / "t.csv", MARKERS, fps=60.0)


@pytest.mark.parametrize("digits", [0, 3])
def test_places_with_few_decimals_are_no_thousands(tmp_path: Path, digits: int) -> None:
    rows = [",".join(f"{value:.{digits}f}" for value in (row / 2 + 1.5).ravel()) for row in PLACES]
    (tmp_path / "t.csv").write_text("\n".join([",".join(head("")[1:]), *rows]))
    tracks = import_tracks(tmp_path / "t.csv", MARKERS, fps=60.0)
    np.testing.assert_allclose(pixels_of(tracks), PLACES / 2 + 1.5, atol=0.51)


@pytest.mark.parametrize("names", [True, False])
@pytest.mark.parametrize("further", [0, 2])
def test_a_row_of_means_at_the_end_is_no_frame(tmp_path: Path, names: bool, further: int) -> None:
    flat = PLACES.reshape(30, -1)
    rows = [*flat, flat.mean(axis=0), *[flat.std(axis=0)] * further]
    lines = [",".join(f"{value:.2f}" for value in row) for row in rows]
    (tmp_path / "t.csv").write_text("\n".join([*([",".join(head("")[1:])] if names else []), *lines]))
    with pytest.raises(InputError, match=f"line {31 + names}: the means of the rows before"):
        import_tracks(tmp_path / "t.csv", MARKERS, fps=60.0)
    if not names:
        with pytest.raises(InputError, match="the means of the rows before"):
            load_tracks(tmp_path / "t.csv", MARKERS, 60.0)


def test_a_robot_that_stays_where_it_is_ends_in_no_means(tmp_path: Path) -> None:
    rows = [",".join(f"{value:.2f}" for value in PLACES[0].ravel())] * 30
    (tmp_path / "t.csv").write_text("\n".join(rows))
    assert len(import_tracks(tmp_path / "t.csv", MARKERS, fps=60.0).time) == 30


def test_times_of_the_clock_on_the_wall_are_one_fault(tmp_path: Path) -> None:
    times = [f"00:00:{k / 60:06.3f}" for k in range(30)]
    with pytest.raises(InputError, match=r"hardly a number in it; found '00:00:00\.000'") as raised:
        import_tracks(table(tmp_path / "t.csv", head("time"), times), MARKERS)
    assert "Write times in seconds" in str(raised.value)
    assert len(raised.value.faults) == 1
