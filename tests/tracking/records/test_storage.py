import numpy as np
import pytest

from swimcal.errors import InputError, ResultsNotWritable
from swimcal.tracks import load_tracks, markers_of, pixels_of
from tests.tracking.records.trials import mixed_trial, same
from tracking.tracked import SampleState, load_tracked, save_tracked, with_states


@pytest.mark.parametrize("seed", range(5))
def test_a_trial_comes_back_bit_for_bit(tmp_path, seed):
    trial = mixed_trial(seed)
    save_tracked(tmp_path, "f1_00", trial)
    assert same(load_tracked(tmp_path, "f1_00"), trial)


def test_the_tracks_are_those_of_the_contract_and_states_are_words(tmp_path):
    trial = mixed_trial(0)
    files = save_tracked(tmp_path, "f1_00", trial)
    assert [path.name for path in files] == ["f1_00.csv", "f1_00.states.csv", "f1_00.flags.json"]
    tracks = load_tracks(files.tracks, markers_of(trial), 60.0)
    assert np.array_equal(pixels_of(tracks), pixels_of(trial), equal_nan=True)
    header, first = files.states.read_text().splitlines()[:2]
    assert header == "time_s,nose_state,nose_size_px,neck_state,neck_size_px,tail_1_state,tail_1_size_px"
    assert first.split(",")[1::2] == ["measured"] * 3


def test_nothing_is_half_written(tmp_path):
    before, after = mixed_trial(0), mixed_trial(1)
    files = save_tracked(tmp_path, "f1_00", before)
    files.flags.unlink()
    files.flags.mkdir()  # which cannot be written over
    with pytest.raises(ResultsNotWritable, match=r"flags\.json"):
        save_tracked(tmp_path, "f1_00", after)
    assert np.array_equal(load_tracks(files.tracks, markers_of(before), 60.0).time.values, before.time.values)
    assert not list(tmp_path.glob("*.part.*")) + list(tmp_path.glob(".*"))


@pytest.mark.parametrize(
    ("there", "instead"), [("measured", "measurd"), ("measured", "missing"), (",measured", ""), ("nose_", "eel_")]
)
def test_states_that_do_not_fit_the_tracks_are_reported_with_what_is_wrong_there(tmp_path, there, instead):
    files = save_tracked(tmp_path, "f1_00", mixed_trial(0))
    files.states.write_text(files.states.read_text().replace(there, instead, 1))
    files.flags.write_text("[3]")
    with pytest.raises(InputError, match="not a list of flags") as raised:
        load_tracked(tmp_path, "f1_00")
    assert "not the states of the tracks next to it; found 12 rows" in str(raised.value)
    assert "Make it again with `calib track`" in str(raised.value)


def test_a_state_that_contradicts_its_position_is_refused():
    trial = mixed_trial(0)
    state = trial.state.values.copy()
    state[0, 1] = SampleState.MISSING
    with pytest.raises(ValueError, match=r"1 samples are MISSING with a position.*neck in frame 0"):
        with_states(trial, state, trial["size"].values)
    with pytest.raises(ValueError, match=r"state: found \[9\]"):
        with_states(trial, np.full_like(state, 9), trial["size"].values)
    with pytest.raises(ValueError, match=r"size_px: found shape \(2, 2\), expected \(12, 3\)"):
        with_states(trial, trial.state.values, np.zeros((2, 2)))
