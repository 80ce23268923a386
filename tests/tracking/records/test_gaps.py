import numpy as np
import pytest

from swimcal.create_session import FISHSIM_MARKERS
from swimcal.robot import load_robot
from swimcal.tracks import load_tracks, markers_of, pixels_of
from tests.cases import later
from tests.swimcal.sample import FISHSIM, needs_fishsim
from tests.tracking.fish import FPS, MARKERS, swimming_fish
from tests.tracking.records.trials import same, tracked_of, twin_px
from tracking import gaps
from tracking.gaps import fill_gaps
from tracking.quality import check_tracks
from tracking.tracked import SampleState, seen_in

NOISE_PX = 0.15


def cut(position_px: np.ndarray, names: tuple[str, ...], first: int, long: int) -> np.ndarray:
    """The positions without `long` frames of some markers."""
    position = position_px.copy()
    position[first : first + long, [MARKERS.index(name) for name in names]] = np.nan
    return position


def error_px(names: tuple[str, ...], long: int) -> float:
    """RMS error an axis over gaps all along the twin's swims."""
    rng = np.random.default_rng(0)
    index = [MARKERS.index(name) for name in names]
    off = []
    for true in twin_px():
        noisy = true + rng.normal(0, NOISE_PX, true.shape)
        for first in range(30, 150, 30):
            filled = fill_gaps(tracked_of(cut(noisy, names, first, long)))
            gap = slice(first, first + long)
            assert (filled.state.values[gap, index] == SampleState.INTERPOLATED).all()
            off.append((pixels_of(filled) - true)[gap, index])
    return float(np.sqrt(np.mean(np.square(off))))


@pytest.mark.parametrize(
    ("names", "long", "at_most_px"),
    [
        (("tail_5",), 30, 0.3),
        (("tail_5", "caudal_fin"), 15, 1.5),
        (("nose",), 15, 0.3),
        (MARKERS, 7, 1.4),
        *later(
            (("tail_5",), 3, 0.3),
            (("tail_5",), 15, 0.3),
            (("caudal_fin",), 15, 1.2),
            (("tail_4", "tail_5"), 15, 0.4),
            (MARKERS, 3, 0.4),
        ),
    ],
)
def test_a_filled_gap_follows_the_beating_tail(monkeypatch, names, long, at_most_px):
    monkeypatch.setattr(gaps, "LONGEST_S", 9.0)
    monkeypatch.setattr(gaps, "WORST_PX", 99.0)
    assert error_px(names, long) < at_most_px


def test_the_rehearsed_error_decides_whether_a_gap_is_filled():
    true = twin_px()[2]  # 2.25 Hz
    lost = fill_gaps(tracked_of(cut(true, MARKERS, 60, 13)))
    tail = MARKERS.index("tail_5")
    assert (lost.state[60:73, tail] == SampleState.MISSING).all()
    flag = next(flag for flag in lost.flags if flag.markers == ("tail_5",))
    assert flag.kind == "gap"
    assert flag.frames == (60, 72)
    assert "px only, and 3 px is the limit" in flag.message


def test_gaps_longer_than_the_limit_and_at_the_ends_stay_missing_and_are_flagged():
    position = cut(twin_px()[0], ("tail_3",), 50, 15)
    position = cut(position, ("nose",), 0, 4)
    position = cut(position, ("neck",), 100, 14)
    filled = fill_gaps(tracked_of(position))
    assert [(flag.kind, flag.markers, flag.frames) for flag in filled.flags] == [
        ("gap", ("nose",), (0, 3)),
        ("gap", ("tail_3",), (50, 64)),
    ]
    assert filled.flags[1].message == "tail_3 is not seen in 15 frames: 0.27 s, and gaps are filled up to 0.25 s"
    assert np.isnan(pixels_of(filled)[50:65, MARKERS.index("tail_3")]).all()
    assert (filled.state.values[100:114, MARKERS.index("neck")] == SampleState.INTERPOLATED).all()


def test_confidence_falls_with_the_distance_to_seen_samples():
    filled = fill_gaps(tracked_of(cut(twin_px()[0], ("tail_2",), 80, 13)))
    confidence = filled.confidence.values[80:93, MARKERS.index("tail_2")]
    assert (np.diff(confidence[:7]) < 0).all()
    assert np.allclose(confidence, confidence[::-1])
    assert 0 < confidence.min() < confidence.max() < 0.5


@pytest.mark.long
def test_seen_samples_stay_bit_for_bit_and_filling_twice_is_filling_once():
    position = swimming_fish(1.0, 0)
    position[np.random.default_rng(1).random(position.shape[:2]) < 0.1] = np.nan
    before = tracked_of(position)
    once = fill_gaps(before)
    assert np.array_equal(pixels_of(once)[seen_in(before)], position[seen_in(before)])
    assert (once.state.values != SampleState.MISSING).mean() > 0.99
    assert same(fill_gaps(once), once)


def test_predicted_samples_are_filled_too_and_give_nothing():
    true = twin_px()[1]
    plain = fill_gaps(tracked_of(cut(true, ("tail_4",), 40, 8)))
    wild = true.copy()
    tail = MARKERS.index("tail_4")
    wild[40:48, tail] += 50.0
    tracked = tracked_of(wild)
    tracked.state.values[40:48, tail] = SampleState.PREDICTED
    assert same(fill_gaps(tracked), plain)


@needs_fishsim
@pytest.mark.parametrize(("trial", "at_most_px"), [("f0_50", 0.9), ("f1_00", 1.3), ("f1_75", 1.8)])
def test_gaps_cut_into_public_tracks_are_filled_within_their_jitter(trial, at_most_px):
    tracks = load_tracks(FISHSIM / f"{trial}.csv", FISHSIM_MARKERS, FPS)
    position = np.where((check_tracks(tracks, load_robot()).weight > 0)[..., None], pixels_of(tracks), np.nan)
    tail = markers_of(tracks).index("tail_5")
    off = []
    for first in range(30, len(position) - 30, 45):
        gap = slice(first, first + 14)
        if np.isfinite(position[first - 2 : first + 16, tail]).all():
            holed = position.copy()
            holed[gap, tail] = np.nan
            filled = fill_gaps(tracked_of(holed, markers_of(tracks)))
            off.append(pixels_of(filled)[gap, tail] - position[gap, tail])
    assert len(off) >= 4
    assert np.sqrt(np.mean(np.square(off))) < at_most_px


def test_a_short_trial_is_flagged_not_guessed():
    position = twin_px()[0][:12].copy()
    position[5, 3] = np.nan
    filled = fill_gaps(tracked_of(position))
    assert filled.state.values[5, 3] == SampleState.MISSING
    assert "too few samples elsewhere" in filled.flags[0].message
