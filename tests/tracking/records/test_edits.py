import numpy as np
import pytest
import xarray as xr
from hypothesis import given
from hypothesis import strategies as st

from swimcal.flags import Flag
from swimcal.tracks import pixels_of
from tests.tracking.records.test_edit_log import FRAMES, MARKERS, edits
from tests.tracking.records.trials import mixed_trial, same
from tracking.edits import Drop, EditLog, LoggedEdit, Relabel, SetBox, Swap, Undo, apply_edits
from tracking.tracked import SAMPLE, SampleState, only_csrt_flags


def log_of(path, *several) -> EditLog:
    return EditLog(path, MARKERS, FRAMES, tuple(LoggedEdit(line, edit) for line, edit in enumerate(several, start=1)))


@pytest.fixture
def path(tmp_path):
    return tmp_path / "f.edits.jsonl"


@pytest.fixture
def trial() -> xr.Dataset:
    return mixed_trial(0, FRAMES, MARKERS)


@pytest.mark.parametrize(
    ("edit", "left"),
    [
        (Swap(markers=("nose", "neck"), frames=(4, 5)), {"nose": [(2, 3), (6, 7)], "neck": [(4, 5)]}),
        (Relabel(marker="nose", to="tail_1", frames=(6, None)), {"nose": [(2, 5)], "tail_1": [(6, 7)]}),
        (Drop(markers=("nose",), frames=(0, 4)), {"nose": [(5, 7)]}),
        (SetBox(marker="nose", frame=7, box=(1, 1, 9, 9)), {"nose": [(2, 6)]}),
    ],
)
def test_what_only_csrt_saw_goes_with_its_samples(path, edit, left) -> None:
    by_csrt = np.zeros((FRAMES, len(MARKERS)), bool)
    by_csrt[2:8, MARKERS.index("nose")] = True
    trial = mixed_trial(0, FRAMES, MARKERS)
    trial = trial.assign_attrs(flags=(*trial.flags, *only_csrt_flags(by_csrt, MARKERS)))
    flags = [flag for flag in apply_edits(trial, log_of(path, edit)).flags if flag.kind == "only_csrt"]
    assert {
        name: [flag.frames for flag in flags if flag.markers == (name,)] for (name,) in {f.markers for f in flags}
    } == left


@given(st.lists(edits, max_size=4), edits, st.integers(0, 99))
def test_an_undo_restores_bit_for_bit(tmp_path_factory, several, edit, seed):
    trial = mixed_trial(seed, FRAMES, MARKERS)
    path = tmp_path_factory.getbasetemp()
    undone = log_of(path, *several, edit, Undo(line=len(several) + 1))
    assert same(apply_edits(trial, undone), apply_edits(trial, log_of(path, *several)))


@pytest.mark.long
@given(st.lists(edits, min_size=1, max_size=5), st.integers(0, 99))
def test_edits_are_replayed_in_order_and_the_trial_is_left_alone(tmp_path_factory, several, seed):
    trial, kept = mixed_trial(seed, FRAMES, MARKERS), mixed_trial(seed, FRAMES, MARKERS)
    path = tmp_path_factory.getbasetemp()
    one_by_one = trial
    for edit in several:
        one_by_one = apply_edits(one_by_one, log_of(path, edit))
    assert same(apply_edits(trial, log_of(path, *several)), one_by_one, flags=False)
    assert same(trial, kept)


def test_swapped_samples_keep_their_state_under_the_other_name(trial, path):
    edited = apply_edits(trial, log_of(path, Swap(markers=("nose", "tail_1"), frames=(5, 9), note="crossed")))
    assert np.array_equal(edited.state.values[5:10, 0], trial.state.values[5:10, 2])
    assert np.array_equal(edited.confidence.values[5:10, 2], trial.confidence.values[5:10, 0])
    assert np.array_equal(edited["size"].values[5:10, 2], trial["size"].values[5:10, 0], equal_nan=True)
    flag = edited.flags[-1]
    assert (flag.kind, flag.markers, flag.frames) == ("edited", ("nose", "tail_1"), (5, 9))
    assert flag.message == "nose and tail_1 swapped by hand (line 1 of the edit log): crossed"


def test_dropped_samples_are_missing_to_the_end_if_so_asked(trial, path):
    edited = apply_edits(trial, log_of(path, Drop(markers=("neck",), frames=(15, None))))
    assert (edited.state.values[15:, 1] == SampleState.MISSING).all()
    assert (edited.confidence.values[15:, 1] == 0).all()
    assert edited.flags[-1].frames == (15, FRAMES - 1)
    assert np.array_equal(edited.state.values[:, [0, 2]], trial.state.values[:, [0, 2]])


def test_a_relabelled_marker_leaves_none_behind(trial, path):
    edited = apply_edits(trial, log_of(path, Relabel(marker="nose", to="neck", frames=(0, 3))))
    assert np.array_equal(pixels_of(edited)[:4, 1], pixels_of(trial)[:4, 0], equal_nan=True)
    assert (edited.state.values[:4, 0] == SampleState.MISSING).all()


def test_a_box_by_hand_sets_its_frame_and_is_tracked_on_to_where_it_says(trial, path):
    box = SetBox(marker="neck", frame=4, box=(10.0, 20.0, 5.0, 3.0), until=7)
    log = log_of(path, box)

    def retrack(position_px: np.ndarray, marker: int, wanted: SetBox) -> tuple[np.ndarray, tuple[Flag, ...]]:
        assert tuple(position_px[4, 1]) == (12.0, 21.0)
        assert (marker, wanted) == (1, box)
        return np.full(3, np.array(((7.0, 7.0), 0.5, 1, 20.0, False), SAMPLE)), (Flag("doubtful_box", ("neck",)),)

    plain = apply_edits(trial, log)
    edited = apply_edits(trial, log, retrack)
    assert [flag.kind for flag in edited.flags[-2:]] == ["edited", "doubtful_box"]
    assert (pixels_of(edited)[5:8, 1] == 7.0).all()
    assert (edited["size"].values[5:8, 1] == 20.0).all()
    changed = np.zeros(trial.state.shape, dtype=bool)
    changed[5:8, 1] = True
    keeps = np.where(changed[..., None], 0.0, pixels_of(edited))
    assert np.array_equal(keeps, np.where(changed[..., None], 0.0, pixels_of(plain)), equal_nan=True)
    assert edited.confidence.values[4, 1] == 1.0
