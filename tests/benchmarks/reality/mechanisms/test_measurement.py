import numpy as np
import pytest

from benchmarks.reality.camera import Camera, Picture, Sight
from benchmarks.reality.mechanism import worn
from benchmarks.reality.mechanisms import EVERY
from benchmarks.reality.mechanisms.measurement import (
    CameraParallax,
    HeadFrameMisalignment,
    LensDistortion,
    MarkerOffset,
    MarkerSwap,
    RollingShutter,
    ScaleError,
    TimeBaseError,
    TrackerDrift,
)
from swimcal.create_session import FISHSIM_MARKERS
from swimcal.robot import load_robot

TIME_S = np.arange(241) / 60
CAMERA = Camera()
NOSE, NECK = FISHSIM_MARKERS.index("nose"), FISHSIM_MARKERS.index("neck")


@pytest.fixture
def sight():
    """A stiff fish that swims ahead and yaws."""
    place = np.array([load_robot().markers[name].position_m[0] for name in FISHSIM_MARKERS])
    axis = -np.exp(1j * (0.3 + 0.2 * np.sin(2 * np.pi * TIME_S)))[:, None]  # tailwards
    head = 0.1 * np.exp(0.3j) * TIME_S[:, None] - 0.2j
    axes = np.repeat(axis, len(place), axis=1)
    return Sight(FISHSIM_MARKERS, TIME_S, head + place * axes, axes, np.zeros(axes.shape))


def pictured(mechanism, sight, camera=CAMERA):
    sight = mechanism.place(sight)
    picture = Picture(sight.names, sight.time_s, camera.project(sight.marker_m, sight.height_m), camera)
    return mechanism.picture(picture).position_px


def plain_px(sight, camera=CAMERA):
    return camera.project(sight.marker_m, sight.height_m)


def test_boxes_of_nose_and_neck_turn_the_head_frame(sight):
    moved = HeadFrameMisalignment(nose_m=-0.002, neck_m=0.003, follows_s=1e6).place(sight).marker_m
    line, was = moved[0, NECK] - moved[0, NOSE], sight.marker_m[0, NECK] - sight.marker_m[0, NOSE]
    assert np.angle(line / was) == pytest.approx(np.arctan(0.005 / 0.142), abs=1e-12)
    others = np.delete(moved - sight.marker_m, [NOSE, NECK], axis=1)
    assert not others.any()
    assert np.ptp((moved - sight.marker_m)[:, NOSE]) == pytest.approx(0.0, abs=1e-8)  # constant in the picture


def test_the_scale_is_wrong_by_its_share(sight):
    (mechanism,) = EVERY["scale_error"](np.random.default_rng(3))(5.0)
    assert isinstance(mechanism, ScaleError)
    moved = mechanism.place(sight).marker_m
    apart = np.abs(moved[:, NECK] - moved[:, NOSE]) / 0.142
    assert abs(apart[0] - 1) == pytest.approx(0.1, abs=1e-9)
    assert np.abs(apart - apart[0]).max() < 0.01  # not quite constant: the boxes do not turn with the head


def test_nearness_is_a_lower_camera_at_the_same_scale(sight):
    heights = tuple((name, 0.01 * i) for i, name in enumerate(FISHSIM_MARKERS))
    near = Camera(height_m=CAMERA.height_m / 3, focal_px=CAMERA.focal_px / 3)
    as_high = CameraParallax(1.0, heights)
    assert pictured(CameraParallax(3.0, heights), sight) == pytest.approx(pictured(as_high, sight, near), abs=1e-9)
    assert not np.allclose(pictured(as_high, sight), plain_px(sight), atol=1.0)


def test_a_lens_draws_the_lower_edge_by_the_sum_of_its_terms():
    middle = CAMERA.centre_px
    edge = middle + np.array([0.0, CAMERA.height_px / 2])
    half = middle + np.array([CAMERA.height_px / 4, 0.0])
    picture = Picture(("a", "b", "c"), np.zeros(1), np.array([[middle, edge, half]]), CAMERA)
    moved = LensDistortion(-0.05, 0.01, 0.0, 0.0).picture(picture).position_px - picture.position_px
    assert moved[0, 0] == pytest.approx([0.0, 0.0])
    assert moved[0, 1] == pytest.approx([0.0, 1080 * (-0.05 + 0.01)])
    assert moved[0, 2] == pytest.approx([540 * (-0.05 / 4 + 0.01 / 16), 0.0])


def test_a_slow_clock_stretches_its_seconds():
    assert TimeBaseError(0.03, 0.0, 0.0).expose(TIME_S) == pytest.approx(1.03 * TIME_S)
    swaying = TimeBaseError(-0.1, 0.5, 1.0).expose(np.arange(0, 3.01, 0.01))
    assert swaying[300] == pytest.approx(0.9 * 3.0)  # a whole sway
    pace = np.gradient(swaying, 0.01)
    assert (pace.min(), pace.max()) == pytest.approx((1 - 0.15, 1 - 0.05), abs=1e-3)


def test_lines_are_read_one_after_the_other():
    """A marker that goes down by v px/s: y = y0 + v (t + R ((y + 1/2) / H - s)), solved for y."""
    speed, readout_s, stamped = np.array([300.0, -200.0]), 0.03, 0.4
    start = np.array([100.0, 1500.0])
    y = start + np.multiply.outer(TIME_S, speed)
    picture = Picture(("a", "b"), TIME_S, np.stack([2 * y, y], axis=-1), CAMERA)
    seen = RollingShutter(readout_s, stamped).picture(picture).position_px
    per_line = readout_s / CAMERA.height_px
    expected = (y + speed * (0.5 * per_line - readout_s * stamped)) / (1 - speed * per_line)
    assert seen[..., 1] == pytest.approx(expected, abs=1e-6)
    assert seen[..., 0] == pytest.approx(2 * expected, abs=1e-6)


def test_a_glued_marker_is_off_by_a_constant_of_its_link(sight):
    glued = MarkerOffset((("tail_3", 0.004 - 0.002j),), glued=1.0).place(sight).marker_m
    third = FISHSIM_MARKERS.index("tail_3")
    off = (glued - sight.marker_m) * sight.axis.conj()
    assert off[:, third] == pytest.approx(np.full(len(off), 0.004 - 0.002j))
    assert not np.delete(off, third, axis=1).any()
    boxed = MarkerOffset((("tail_3", 0.004 - 0.002j),), glued=0.0).place(sight).marker_m
    assert np.abs(np.diff(boxed - sight.marker_m, axis=0)).max() < 1e-15


def test_a_box_slides_at_its_pace_until_it_holds_on(sight):
    first = FISHSIM_MARKERS.index("tail_1")

    def slid(pace, walk):
        marker_m = TrackerDrift((("tail_1", pace),), walk, seed=1).place(sight).marker_m
        return ((marker_m - sight.marker_m) * sight.axis.conj())[:, first]

    steady = slid(0.001, 0.0)
    assert steady[-1].real == pytest.approx(0.004, rel=0.01)
    assert np.abs(steady.imag).max() < 1e-15
    assert 0.039 < slid(0.1, 0.0)[-1].real < 0.04
    walked = np.diff(slid(0.0, 1e-4).real)
    assert walked.std() == pytest.approx(1e-4 / np.sqrt(60), rel=0.15)


def test_exchanges_are_whole_and_take_their_share_of_the_time():
    time_s = np.arange(60_000) / 60
    px = np.stack(np.broadcast_arrays(np.array([10.0, 50.0]), time_s[:, None]), axis=-1)
    picture = Picture(("tail_1", "tail_2"), time_s, px, CAMERA)

    def exchanged(share):
        seen = MarkerSwap("tail_1", "tail_2", share, seed=5).picture(picture).position_px
        assert set(np.unique(seen[..., 0])) <= {10.0, 50.0}
        assert (seen[..., 0].sum(axis=1) == 60.0).all()
        return seen[:, 0, 0] == 50.0

    seldom, often = exchanged(0.1), exchanged(0.4)
    assert seldom.mean() == pytest.approx(0.1, abs=0.02)
    assert often.mean() == pytest.approx(0.4, abs=0.03)
    assert not (seldom & ~often).any()


def test_chance_is_another_in_each_trial_of_a_session(sight):
    drift = TrackerDrift((("tail_1", 0.0),), 1e-3, seed=1)
    swap = MarkerSwap("tail_1", "tail_2", 0.3, seed=5)
    for mechanism in (drift, swap):
        first, later = (pictured(each, sight) for (each,) in (worn([mechanism], 0.0), worn([mechanism], 30.0)))
        assert np.array_equal(first, pictured(mechanism, sight))
        assert not np.array_equal(first, later)
