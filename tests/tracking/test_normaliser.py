import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.tracking.fish import MARKERS, PX_PER_M, swimming_fish
from tracking.head_frame import from_head_frame, to_head_frame

NOSE, NECK = 0, 1


def swim(frames: int = 120, seed: int = 1) -> np.ndarray:
    """(n, m, 2) in the pool, y up, m."""
    return swimming_fish(1.0, seed, frames=frames) * [1, -1] / PX_PER_M


def moved(position_m: np.ndarray, turn: float, shift: np.ndarray) -> np.ndarray:
    cos, sin = np.cos(turn), np.sin(turn)
    return position_m @ np.array([[cos, sin], [-sin, cos]]) + shift


def by_loop(position_m: np.ndarray) -> np.ndarray:
    """The published recursion, frame by frame and marker by marker, in the axes half-way between two frames."""
    path, before, frames = np.zeros(2), None, []
    for markers in position_m:
        forward = (markers[NECK] - markers[NOSE]) / np.linalg.norm(markers[NECK] - markers[NOSE])
        axes = np.array([forward, [-forward[1], forward[0]]])
        place = markers[NOSE]
        if before is not None:
            middle = (forward + before[0]) / np.linalg.norm(forward + before[0])
            path = path + np.array([middle, [-middle[1], middle[0]]]) @ (place - before[1])
        before = forward, place
        frames.append([axes @ (marker - markers[NOSE]) + path for marker in markers])
    return np.array(frames)


def test_the_published_recursion_as_a_plain_loop_gives_the_same() -> None:
    assert to_head_frame(swim(), NOSE, NECK).position_m == pytest.approx(by_loop(swim()), abs=1e-12)


@given(st.floats(-10, 10), st.floats(-5, 5), st.floats(-5, 5))
def test_where_and_how_the_pool_lies_does_not_matter(turn: float, x: float, y: float) -> None:
    position = swim(frames=30)
    one = to_head_frame(position, NOSE, NECK)
    other = to_head_frame(moved(position, turn, np.array([x, y])), NOSE, NECK)
    assert other.position_m == pytest.approx(one.position_m, abs=1e-9)
    assert other.path_m == pytest.approx(one.path_m, abs=1e-9)
    assert np.diff(other.heading_rad) == pytest.approx(np.diff(one.heading_rad), abs=1e-9)
    assert np.sin(other.heading_rad - one.heading_rad) == pytest.approx(np.sin(turn), abs=1e-9)


def test_a_straight_swim_gives_the_distance_forward() -> None:
    body = np.stack([np.linspace(0, 0.5, len(MARKERS)), np.zeros(len(MARKERS))], axis=1)
    swum = 0.2 * np.arange(60) / 60
    position = moved(body - np.stack([swum, 0 * swum], axis=1)[:, None], 0.7, np.array([1.0, 2.0]))
    frame = to_head_frame(position, NOSE, NECK)
    assert frame.forward_m == pytest.approx(swum)
    assert frame.path_m[:, 1] == pytest.approx(0, abs=1e-12)
    assert frame.shape_m == pytest.approx(np.broadcast_to(body, frame.shape_m.shape))
    assert frame.heading_rad == pytest.approx(0.7)


def test_a_marker_of_the_head_missing_for_some_frames_is_bridged() -> None:
    position = swim()
    gappy = position.copy()
    gappy[40:46, NOSE] = np.nan
    whole, frame = to_head_frame(position, NOSE, NECK), to_head_frame(gappy, NOSE, NECK)
    assert np.isnan(frame.position_m[40:46]).all()
    assert np.isnan(frame.heading_rad[40:46]).all()
    known = np.r_[0:40, 46:120]
    assert np.isfinite(frame.position_m[known]).all()
    assert frame.position_m[:40] == pytest.approx(whole.position_m[:40])
    assert frame.position_m[46:] == pytest.approx(whole.position_m[46:], abs=0.004)
    assert np.isfinite(frame.path_m).all()


def test_frames_that_are_not_trusted_are_bridged_as_if_they_were_missing() -> None:
    position = swim()
    seen = (np.arange(120) < 40) | (np.arange(120) >= 46)
    gappy, wrong = position.copy(), position.copy()
    gappy[40:46, NOSE], wrong[40:46, NOSE] = np.nan, 0.3
    missing, distrusted = to_head_frame(gappy, NOSE, NECK), to_head_frame(wrong, NOSE, NECK, seen)
    assert distrusted.path_m == pytest.approx(missing.path_m)
    assert np.isnan(distrusted.heading_rad[40:46]).all()
    assert distrusted.nose_m == pytest.approx(missing.nose_m)


@given(st.integers(2, 6))
def test_the_path_does_not_depend_on_the_frame_rate(every: int) -> None:
    position = swim(frames=601)
    whole, fewer = to_head_frame(position, NOSE, NECK), to_head_frame(position[::every], NOSE, NECK)
    assert fewer.path_m[-1] == pytest.approx(whole.path_m[: 600 // every * every + 1][-1], abs=4e-4 * every**2)


def test_a_tail_marker_missing_concerns_no_other() -> None:
    position = swim()
    gappy = position.copy()
    gappy[40:46, 5] = np.nan
    frame = to_head_frame(gappy, NOSE, NECK).position_m
    assert np.isnan(frame[40:46, 5]).all()
    frame[40:46, 5] = to_head_frame(position, NOSE, NECK).position_m[40:46, 5]
    assert frame == pytest.approx(to_head_frame(position, NOSE, NECK).position_m)


def spinning(frames: int, step_rad: float, length_m: float) -> np.ndarray:
    """(n, 2, 2) nose and neck, the nose fixed while the head turns."""
    angle = step_rad * np.arange(frames)
    neck = length_m * np.stack([np.cos(angle), np.sin(angle)], axis=1)
    return np.stack([np.zeros_like(neck), neck], axis=1)


def test_heading_is_unwrapped() -> None:
    frame = to_head_frame(spinning(100, 0.2, 0.142), NOSE, NECK)
    assert frame.heading_rad == pytest.approx(0.2 * np.arange(100))


@given(turn=st.floats(-np.pi, np.pi), x=st.floats(-5, 5), y=st.floats(-5, 5), seed=st.integers(0, 20))
def test_it_inverts_the_normaliser_up_to_a_shift(turn: float, x: float, y: float, seed: int) -> None:
    position = moved(swim(60, seed), turn, np.array([x, y]))
    back = from_head_frame(to_head_frame(position, NOSE, NECK))

    np.testing.assert_allclose(back, position - position[0, NOSE], atol=1e-11)


def test_it_inverts_a_path_with_a_gap() -> None:
    position = swim(60)
    seen = (np.arange(60) < 20) | (np.arange(60) >= 30)
    back = from_head_frame(to_head_frame(position, NOSE, NECK, seen))

    np.testing.assert_allclose(back[seen], (position - position[0, NOSE])[seen], atol=1e-11)
