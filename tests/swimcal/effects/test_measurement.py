"""What effects of camera, markers and tracker do, against geometry."""

from dataclasses import replace

import numpy as np
import pytest

from swimcal.effects.affected_twin import AffectedTwin
from swimcal.effects.catalogue import catalogue
from swimcal.effects.effect import Observation, View
from swimcal.effects.measurement import MarkerOffset, MarkerSwap, TrackerDrift
from tests.swimcal.effects.swims import PLAIN, TIME_S, runs_with, with_effect

NAMES = ("nose", "neck", "tail_1", "tail_2")
UNTURNED = np.broadcast_to(np.eye(2), (4, 4, 2, 2))
VIEW = View(axis_m=np.array([1.0, 0.0]), down=np.array([0.0, 1.0]), half_height_m=0.5)


@pytest.fixture
def seen() -> Observation:
    """Four markers in a row that move across at 1 m/s; the last is 0.1 m above the others."""
    time_s = 0.1 * np.arange(4)
    marker_m = np.zeros((4, 4, 2))
    marker_m[..., 0] = [0.0, 0.2, 0.4, 0.6]
    marker_m[..., 1] = time_s[:, None]
    return Observation(time_s, marker_m, UNTURNED, 6 * time_s, NAMES, np.array([0.0, 0.0, 0.0, 0.1]), VIEW)


def found(name: str, seen: Observation, *values: float) -> np.ndarray:
    return catalogue()[name].observe(seen, np.array(values)) - seen.marker_m


def test_nose_and_neck_alone_are_shifted_across_the_body(seen: Observation) -> None:
    off = found("head_frame_misalignment", seen, 0.01, -0.02, 0.0, 0.0)
    assert off[:, :2, 1] == pytest.approx(np.tile([0.01, -0.02], (4, 1)))
    assert np.abs(off[..., 0]).max() == np.abs(off[:, 2:]).max() == 0


def test_a_wrong_scale_is_a_neck_too_far_back(seen: Observation) -> None:
    off = found("scale_error", seen, 0.05, 0.0)
    assert off[:, 1] == pytest.approx(np.tile([0.01, 0.0], (4, 1)))  # a share of 0.2 m
    assert np.abs(np.delete(off, 1, axis=1)).max() == 0


def test_boxes_keep_the_offset_of_the_first_frame_as_the_head_turns(seen: Observation) -> None:
    """Turned by a right angle from the second frame on, with nose and neck 0.2 m apart along y."""
    axes, marker_m = UNTURNED.copy(), seen.marker_m.copy()
    axes[1:] = [[0.0, 1.0], [-1.0, 0.0]]
    marker_m[1:, 1] = marker_m[1:, 0] + [0.0, 0.2]
    turned = replace(seen, axes=axes, marker_m=marker_m)
    across = found("head_frame_misalignment", turned, 0.01, 0.0, 0.0, -0.02)
    assert across[1:, :2] == pytest.approx(np.tile([[-0.01, 0.0], [0.0, -0.02]], (3, 1, 1)))
    along = found("scale_error", turned, 0.05, 0.1)
    assert along[1:, 1] == pytest.approx(np.tile([0.02, 0.01], (3, 1)))


def test_a_marker_above_the_others_is_seen_by_similar_triangles(seen: Observation) -> None:
    """Under a camera 1 m up, a point 0.1 m up is magnified 1 / 0.9; it stands 0.4 m off the axis."""
    off = found("camera_parallax", seen, 1.0, 0.0, 0.0)
    assert off[0, 3] == pytest.approx([-0.4 / 0.9 + 0.4, 0.0])
    assert np.abs(off[:, :3]).max() == 0


def test_nose_and_neck_that_are_nearer_to_the_camera_are_magnified_alone(seen: Observation) -> None:
    off = found("camera_parallax", seen, 0.0, 0.1, 0.05)
    expected = (seen.marker_m[:, :2] - seen.view.axis_m) * np.array([0.1 / 0.9, 0.05 / 0.95])[:, None]
    assert off[:, :2] == pytest.approx(expected)
    assert np.abs(off[:, 2:]).max() == 0


def test_a_lens_shifts_by_the_cube_of_the_radius(seen: Observation) -> None:
    off = found("lens_distortion", seen, 0.1)
    assert off[0, :, 0] == pytest.approx(-0.1 * np.array([1.0, 0.8, 0.6, 0.4]) ** 3 / 0.25)


def test_lower_lines_are_read_later(seen: Observation) -> None:
    off = found("rolling_shutter", seen, 0.02)
    assert off[:, 0, 1] == pytest.approx(0.02 * seen.marker_m[:, 0, 1] / 1.0)  # 1 m/s times the line's delay


def test_a_glued_marker_rides_on_its_link() -> None:
    _, observed = with_effect(catalogue()["marker_offset"], np.eye(18)[7] * 0.01)
    plain = PLAIN.simulate(runs_with(np.zeros(0)), TIME_S)
    off = observed - plain.marker_m
    marker = PLAIN.markers.index("tail_1")
    assert np.linalg.norm(off[:, :, marker], axis=-1) == pytest.approx(0.01)
    head = plain.head[..., 2] + plain.hinges_rad[..., 0]
    assert off[:, :, marker, 0] == pytest.approx(-0.01 * np.sin(head), abs=1e-12)
    assert np.abs(np.delete(off, marker, axis=2)).max() == 0


@pytest.mark.parametrize("way", [0, 1])
def test_a_box_slides_along_the_body_or_across(seen: Observation, way: int) -> None:
    drift = TrackerDrift(NAMES)
    values = np.zeros(len(drift.parameters))
    values[2 + way] = 0.01  # the second marker after nose and neck
    off = drift.observe(seen, values) - seen.marker_m
    assert np.einsum("fd,fd->f", off[:, 3], seen.axes[:, 3, way]) == pytest.approx(0.01 * seen.time_s)
    assert np.linalg.norm(off[:, 3], axis=-1) == pytest.approx(0.01 * seen.time_s)
    assert np.abs(off[:, :3]).max() == 0
    assert MarkerOffset(NAMES).observe(seen, np.array([0, 0, 0.01, 0.0]))[0, 3, 0] == pytest.approx(0.61)


def test_wholly_swapped_markers_are_exchanged(seen: Observation) -> None:
    swapped = MarkerSwap(("tail_1", "tail_2")).observe(seen, np.ones(1))
    assert swapped[:, [2, 3]] == pytest.approx(seen.marker_m[:, [3, 2]])


def test_a_slow_clock_is_seen_in_times_and_in_frequency() -> None:
    """A crank measured at f on a clock whose seconds last 1.1 s turns at f / 1.1: frame by frame it is in step."""
    affected, runs = AffectedTwin(PLAIN, [catalogue()["time_base_error"]]), runs_with(np.array([0.1]))
    simulated, plain = affected.simulate(runs, TIME_S), PLAIN.simulate(runs_with(np.zeros(0)), TIME_S)
    assert simulated.crank_rad == pytest.approx(plain.crank_rad, abs=0.01)
    assert affected.measured_hz(1.0, np.array([0.1])) == pytest.approx(1.1)
    assert simulated.time_s is TIME_S
