import gzip

import numpy as np
import pytest
import xarray as xr

from swimcal.errors import InputError
from swimcal.tracks import markers_of, pixels_of
from tests.cases import changed
from tests.tracking.records.trials import mixed_trial
from tracking.formats import FORMATS, export_tracks, import_tracks, to_movement
from tracking.tracked import SampleState, with_states

MARKERS = ("nose", "neck", "tail_1")
FPS = 50.0
DLC = """scorer,net,net,net,net,net,net
bodyparts,nose,nose,nose,neck,neck,neck
coords,x,y,likelihood,x,y,likelihood
3,1.5,2,0.9,,,0.01
4,1.6,2,0.8,7,8,1
"""
MULTI = """scorer,net,net,net,net,net,net
individuals,fish,fish,fish,fish,fish,fish
bodyparts,nose,nose,nose,neck,neck,neck
coords,x,y,likelihood,x,y,likelihood
0,1.5,2,0.9,5,6,0.7
1,1.6,2,0.8,7,8,1
"""


def steady_trial(seed: int) -> xr.Dataset:
    """Frames at k / FPS, which every form can hold."""
    trial = mixed_trial(seed)
    tracks = changed(trial, time_s=np.arange(trial.sizes["time"]) / FPS)
    return with_states(tracks, trial.state.values, trial["size"].values)


def written(tmp_path, text: str):
    path = tmp_path / "tracks.csv"
    path.write_text(text)
    return path


@pytest.mark.parametrize("form", FORMATS)
def test_what_is_written_is_recognised_by_content_and_comes_back(tmp_path, form):
    trial = steady_trial(1)
    path = tmp_path / "anything.dat"
    export_tracks(trial, path, form)
    tracks = import_tracks(path, MARKERS, FPS)
    assert np.array_equal(pixels_of(tracks), pixels_of(trial), equal_nan=True)
    assert np.array_equal(tracks.time.values, trial.time.values)
    if form != "fishsim":
        assert np.array_equal(tracks.confidence.values, trial.confidence.values)


@pytest.mark.parametrize("form", ["deeplabcut", "movement"])
def test_markers_come_in_the_order_asked_for_and_others_are_left_out(tmp_path, form):
    trial = steady_trial(2)
    export_tracks(trial, tmp_path / "tracks", form)
    tracks = import_tracks(tmp_path / "tracks", ("tail_1", "nose"), FPS)
    assert markers_of(tracks) == ("tail_1", "nose")
    assert np.array_equal(pixels_of(tracks), pixels_of(trial)[:, [2, 0]], equal_nan=True)


@pytest.mark.parametrize("form", ["deeplabcut", "movement"])
def test_markers_that_are_not_there_are_reported_with_the_choices(tmp_path, form):
    export_tracks(steady_trial(2), tmp_path / "tracks", form)
    with pytest.raises(InputError, match=r"'nek'; choices: nose, neck, tail_1\. Did you mean 'neck'"):
        import_tracks(tmp_path / "tracks", ("nek", "nose"), FPS)


def test_deeplabcut_frames_give_the_time_and_empty_cells_are_missing(tmp_path):
    tracks = import_tracks(written(tmp_path, DLC), ("nose", "neck"), FPS)
    assert np.allclose(tracks.time.values, [0.06, 0.08])
    assert np.isnan(pixels_of(tracks)[0, 1]).all()
    assert tracks.confidence.values.tolist() == [[0.9, 0.0], [0.8, 1.0]]


def test_a_name_that_is_taken_is_not_offered_for_a_missing_one(tmp_path):
    with pytest.raises(InputError) as raised:
        import_tracks(written(tmp_path, DLC.replace("neck", "nose_2")), ("nose", "neck"), FPS)
    assert "Did you mean 'nose'" not in str(raised.value)
    with pytest.raises(InputError, match="No trial goes without a marker on the tail"):
        import_tracks(written(tmp_path, DLC), ("nose", "neck", "tail_1"), FPS)


def test_coordinates_with_capitals_are_read_and_percent_is_one_fault(tmp_path):
    capitals = DLC.replace("x,y,likelihood", "X,Y,Likelihood")
    assert import_tracks(written(tmp_path, capitals), ("nose", "neck"), FPS).equals(
        import_tracks(written(tmp_path, DLC), ("nose", "neck"), FPS)
    )
    percent = DLC.replace("0.9", "90").replace("0.8", "80").replace("0.01", "1").replace("7,8,1", "7,8,100")
    with pytest.raises(InputError) as raised:
        import_tracks(written(tmp_path, percent), ("nose", "neck"), FPS)
    assert len(raised.value.faults) == 1
    assert "They look like percent: divide them by 100." in str(raised.value)


def test_a_file_of_a_multi_animal_project_is_read_if_it_holds_one_animal(tmp_path):
    tracks = import_tracks(written(tmp_path, MULTI), ("neck",), FPS)
    assert pixels_of(tracks)[:, 0].tolist() == [[5, 6], [7, 8]]
    with pytest.raises(InputError, match=r"line 2: more than one animal; found fish, eel; expected one"):
        import_tracks(written(tmp_path, MULTI.replace("fish,fish,fish\n", "eel,eel,eel\n")), ("neck",), FPS)


def test_labels_without_likelihood_and_packed_files_are_read(tmp_path):
    lines = [",".join(cell for k, cell in enumerate(line.split(",")) if k not in (3, 6)) for line in DLC.splitlines()]
    path = tmp_path / "labels.csv.gz"
    path.write_bytes(gzip.compress("\n".join(lines).encode()))
    assert import_tracks(path, ("nose", "neck"), FPS).confidence.values.tolist() == [[1, 0], [1, 1]]


def test_faults_of_a_deeplabcut_file_are_reported_at_once(tmp_path):
    text = DLC.replace("1.5,2,0.9", "wide,2,0.9").replace("7,8,1", "7,8")
    with pytest.raises(InputError) as raised:
        import_tracks(written(tmp_path, text), ("nose", "neck"), FPS)
    assert "line 4, column 2 (nose x): not a number; found 'wide'" in str(raised.value)
    assert "line 5: wrong number of columns; found 6 columns; expected 7 columns" in str(raised.value)
    with pytest.raises(InputError) as raised:
        import_tracks(written(tmp_path, DLC.replace("0.9", "1.9").replace("\n4,", "\n2,")), ("nose", "neck"), FPS)
    assert "line 4, nose: confidence out of range; found 1.9; expected 0 to 1" in str(raised.value)
    assert "line 5: frames do not go on" in str(raised.value)


def test_a_body_part_twice_is_refused_and_not_the_first_taken(tmp_path):
    twice = DLC.replace("neck,neck,neck", "nose,nose,nose")
    with pytest.raises(InputError, match="body parts more than once; found nose"):
        import_tracks(written(tmp_path, twice), None, FPS)


def test_a_marker_without_a_y_is_not_offered_the_y_of_another(tmp_path):
    with pytest.raises(InputError, match=r"marker 'neck' has no y; expected x and y$"):
        import_tracks(written(tmp_path, "frame,nose_x,nose_y,neck_x\n0,1,2,3\n1,1,2,3\n"), ("nose", "neck"), FPS)
    with pytest.raises(InputError, match=r"expected x and y\. Did you mean 'nekc_y'"):
        import_tracks(written(tmp_path, "frame,nose_x,nose_y,neck_x,nekc_y\n0,1,2,3,4\n"), ("nose", "neck"), FPS)


def test_a_header_that_is_not_deeplabcuts_is_reported(tmp_path):
    with pytest.raises(InputError, match="rows that start with scorer, bodyparts and coords"):
        import_tracks(written(tmp_path, "scorer,a,a\nkeypoints,nose,nose\n1,2,3\n"), ("nose",), FPS)
    with pytest.raises(InputError, match=r"header rows of different length; found bodyparts: 6, coords: 5"):
        import_tracks(written(tmp_path, DLC.replace("coords,x", "coords")), ("nose",), FPS)


def test_a_movement_dataset_has_the_layout_of_the_package():
    data = to_movement(steady_trial(0).assign_attrs(source="f1_00.mp4"))
    assert data["position"].dims == ("time", "space", "keypoint", "individual")
    assert data["confidence"].dims == ("time", "keypoint", "individual")
    assert data["space"].values.tolist() == ["x", "y"]
    assert data.attrs["ds_type"] == "poses"
    assert data.attrs["time_unit"] == "seconds"
    assert data.attrs["fps"] == pytest.approx(FPS)
    assert data.attrs["source_file"] == "f1_00.mp4"
    assert data["state"].attrs["flag_meanings"].split()[SampleState.BY_HAND] == "by_hand"
    assert np.array_equal(data["state"].values[..., 0], steady_trial(0).state.values)


def test_a_movement_file_of_others_without_our_variables_is_read_with_its_frames_as_times(tmp_path):
    trial = steady_trial(4)
    older = {"keypoint": "keypoints", "individual": "individuals"}  # before version 0.17
    data = to_movement(trial).drop_vars(["state", "size"]).rename(older)
    data = data.assign_coords(time=np.arange(data.sizes["time"]))
    data.attrs["time_unit"] = "frames"
    data.to_netcdf(tmp_path / "f.nc", engine="h5netcdf")
    loaded = import_tracks(tmp_path / "f.nc", MARKERS, FPS)
    assert np.allclose(loaded.time.values, trial.time.values)


def test_what_is_wrong_with_a_movement_file_is_reported(tmp_path):
    path = tmp_path / "f.nc"
    two = xr.concat([to_movement(steady_trial(k)) for k in (0, 1)], dim="individual", join="outer")
    two.assign_coords(individual=["fish", "eel"]).to_netcdf(path, engine="h5netcdf")
    with pytest.raises(InputError, match=r"not one individual; found \['fish', 'eel'\]; expected one"):
        import_tracks(path, MARKERS, FPS)
    xr.Dataset({"position": ("time", [1.0, 2.0])}).to_netcdf(path, engine="h5netcdf")
    with pytest.raises(InputError, match=r"not a poses dataset of movement; found .*position \('time',\)"):
        import_tracks(path, MARKERS, FPS)
    path.write_bytes(b"\x89HDF\r\n\x1a\n and no more")
    with pytest.raises(InputError, match=r"f\.nc: the file cannot be read"):
        import_tracks(path, MARKERS, FPS)


def test_a_file_that_is_not_there_is_reported(tmp_path):
    with pytest.raises(InputError, match="the file is not there"):
        import_tracks(tmp_path / "none.csv", MARKERS, FPS)
    with pytest.raises(InputError, match="the file is not there"):
        import_tracks(tmp_path / "none.nc", MARKERS, FPS)


@pytest.mark.parametrize("form", FORMATS)
def test_frames_that_are_left_out_stay_out_in_every_form(tmp_path, form):
    whole = steady_trial(4)
    kept = np.delete(np.arange(whole.sizes["time"]), slice(5, 9))
    export_tracks(whole.isel(time=kept), tmp_path / "tracks", form)
    found = import_tracks(tmp_path / "tracks", MARKERS, FPS)
    seen = ~np.isnan(pixels_of(found)).all(axis=(1, 2))
    places, times = pixels_of(whole)[kept], whole.time.values[kept]
    present = ~np.isnan(places).all(axis=(1, 2))
    np.testing.assert_array_equal(pixels_of(found)[seen], places[present])
    np.testing.assert_allclose(found.time.values[seen], times[present])


@pytest.mark.parametrize("form", ["deeplabcut", "fishsim"])
def test_forms_without_times_refuse_uneven_ones(tmp_path, form):
    trial = steady_trial(4)
    uneven = np.cumsum(np.where(np.arange(trial.sizes["time"]) % 2, 0.02, 0.031))
    late = np.where(np.arange(trial.sizes["time"]) < 10, trial.time.values, trial.time.values + 7200.0)
    for times in (uneven, late):
        with pytest.raises(InputError, match=f"'{form}' holds no times, and these are not even.*movement, swimcal"):
            export_tracks(trial.assign_coords(time=times), tmp_path / "tracks", form)
        assert not (tmp_path / "tracks").exists()
