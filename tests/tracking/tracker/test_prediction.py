"""Where a marker is looked for: its own motion, and that of its neighbours while it is out of sight."""

import numpy as np
import pytest

from tracking.identities import MarkerMotion

DIAMETER = np.full(4, 14.0)


def carried_through(path: np.ndarray, seen: np.ndarray | None = None) -> tuple[MarkerMotion, list[np.ndarray]]:
    """A motion that took in places (n, m, 2), and what it predicted before each of them but the first."""
    motion = MarkerMotion.begin(path[0], DIAMETER[: path.shape[1]])
    said = []
    seen = np.ones(path.shape[:2], bool) if seen is None else seen
    for place, there in zip(path[1:], seen[1:], strict=True):
        predicted = motion.predict(DIAMETER[: path.shape[1]])
        said.append(predicted.position_px)
        motion.update(predicted.position_px, place, there)
    return motion, said


def turning(frames: int, markers: int = 4) -> np.ndarray:
    """(n, m, 2) markers on a rigid body that turns and moves."""
    rng = np.random.default_rng(3)
    place = rng.uniform(-60, 60, (markers, 2))
    angle = 0.04 * np.arange(frames)
    cos, sin = np.cos(angle)[:, None], np.sin(angle)[:, None]
    turned = np.stack([cos * place[:, 0] - sin * place[:, 1], sin * place[:, 0] + cos * place[:, 1]], axis=-1)
    return turned + 2.0 * np.arange(frames)[:, None, None] + 200.0


def test_steady_acceleration_is_predicted_exactly_from_the_third_frame_on() -> None:
    t = np.arange(12.0)[:, None, None]
    rng = np.random.default_rng(1)
    place, velocity, acceleration = rng.normal(0, 5, (3, 1, 4, 2))
    path = 100 + place + velocity * t + 0.5 * acceleration * t**2
    _, said = carried_through(path)
    assert np.abs(said[3:] - path[4:]).max() < 1e-3


def test_a_lost_marker_is_carried_along_rigidly() -> None:
    path = turning(40)
    seen = np.ones((40, 4), bool)
    seen[10:, 0] = False
    motion, said = carried_through(path, seen)
    assert np.abs(np.array(said)[9:, 0] - path[10:, 0]).max() < 0.8
    assert motion.unseen.tolist() == [30, 0, 0, 0]


def test_a_marker_alone_coasts_and_comes_to_rest() -> None:
    path = np.arange(6.0)[:, None, None] * [4.0, 0.0] + 50.0
    motion, _ = carried_through(path)
    start = motion.past[0, 0, 0]
    for _ in range(40):
        predicted = motion.predict(DIAMETER[:1])
        motion.update(predicted.position_px, predicted.position_px, np.array([False]))
    travelled = motion.past[0, 0, 0] - start
    assert 4.0 < travelled < 16.0


def test_the_gate_grows_while_a_marker_is_lost_and_is_bounded() -> None:
    path = turning(10)
    motion, _ = carried_through(path)
    gates = []
    for _ in range(60):
        predicted = motion.predict(DIAMETER)
        gates.append(predicted.gate_px[0])
        seen = np.array([False, True, True, True])
        motion.update(predicted.position_px, predicted.position_px, seen)
    assert (np.diff(gates[:10]) > 0).all()
    assert (np.diff(gates) >= 0).all()
    assert gates[-1] == pytest.approx(5 * 14.0)


def test_a_beat_is_predicted_exactly_once_it_is_known_however_fast_it_is() -> None:
    """At 30 px and a tenth of a turn a frame; the parabola alone is up to 11 px off."""
    beat = 0.6 * np.arange(60.0)[:, None]
    sway = 50.0 * np.sin(beat + np.array([0.0, 0.5, 1.0, 2.0]))
    path = 200 + np.stack([0.2 * sway, sway], axis=2)
    _, said = carried_through(path)
    assert np.abs(said[20:] - path[21:]).max() < 0.01
