import numpy as np
import pytest

from swimgym import Circle, Rules
from swimgym.course import make_course
from swimgym.policy import share
from tests.swimgym.fish import fish


def test_what_is_seen_is_in_the_heads_frame() -> None:
    course = make_course("target", 1, fish=fish(), workers=1)
    course.begin(np.arange(1), np.random.default_rng(0))
    course.swimmers.rest(np.arange(1), np.array([[0.0, 0.0]]), np.array([np.pi / 2]))  # heading along -y
    course.task.places[0] = 0.0, -2.0  # type: ignore[attr-defined]
    seen = dict(zip(course.names, course.look()[0][0], strict=True))
    assert len(course.names) == 22
    assert seen["distance"] == pytest.approx(2.0)
    assert (seen["target_x"], seen["target_y"]) == pytest.approx((-2.0, 0.0), abs=1e-12)  # straight ahead
    assert (seen["crank_cos"], seen["crank_sin"], seen["last_action"]) == (1.0, 0.0, 0.0)


def test_the_target_comes_nearer_at_the_rate_that_is_seen() -> None:
    course = make_course("target", 1, fish=fish(), workers=1, interval_s=0.004)
    course.begin(np.arange(1), np.random.default_rng(1))
    for _ in range(250):
        moment = course.act(np.array([0.05]))
    seen = dict(zip(course.names, moment.seen[0], strict=True))
    toward = (seen["target_x"] * seen["target_x_rate"] + seen["target_y"] * seen["target_y_rate"]) / seen["distance"]
    after = course.act(np.array([0.0]))
    assert (after.distance_m[0] - moment.distance_m[0]) / 0.004 == pytest.approx(toward, rel=0.05)


def test_an_action_is_an_acceleration_and_the_tail_beats_no_faster_than_allowed() -> None:
    rules = Rules(acceleration_rad_s2=400.0)
    np.testing.assert_allclose(rules.speed(np.array([1.0]), np.array([0.5])), 1.0 + 0.5 * 400 * 0.02)
    np.testing.assert_allclose(rules.speed(np.array([30.0, -30.0]), np.array([3.0, -3.0])), [10 * np.pi, -10 * np.pi])
    with pytest.raises(ValueError, match="interval_s: found 0, expected a number above 0"):
        Rules(interval_s=0)


def test_the_reward_is_distance_effort_and_goal() -> None:
    course = make_course("target", 2, fish=fish(), workers=1)
    course.begin(np.arange(2), np.random.default_rng(0))
    course.task.places[:] = [[-1.0, 0.0], [-0.03, 0.0]]  # type: ignore[attr-defined]
    moment = course.act(np.array([-0.25, 0.5]))
    np.testing.assert_allclose(moment.reward, -moment.distance_m - [0.25, 0.5] + [0, 300])
    assert moment.reached.tolist() == [False, True]


def test_targets_lie_in_the_square_ahead() -> None:
    course = make_course("target", 500, fish=fish(), workers=1)
    course.begin(np.arange(500), np.random.default_rng(0))
    places = course.task.places  # type: ignore[attr-defined]
    assert (np.linalg.norm(places, axis=1) > 0.05).all()
    assert places.min(axis=0) == pytest.approx([-4, -2], abs=0.05)
    assert places.max(axis=0) == pytest.approx([0, 2], abs=0.05)


def test_the_circle_is_around_its_middle_and_its_target_leads() -> None:
    circle = Circle(2, radius_m=1.0, lead_m=0.3)
    circle.side[:] = 1.0, -1.0  # left, right
    for angle in np.linspace(0.0, 6.5, 40):
        on = np.array([[-np.sin(angle), np.cos(angle) - 1], [-np.sin(angle), 1 - np.cos(angle)]])
        target, _ = circle.ahead(on)
        np.testing.assert_allclose(circle.off_path(on), 0.0, atol=1e-12)
        np.testing.assert_allclose(np.linalg.norm(target - on, axis=1), 2 * np.sin(0.15), rtol=1e-6)
        assert (circle.reached(np.zeros(2)) == (angle >= 2 * np.pi)).all()
    np.testing.assert_allclose(circle.off_path(1.1 * (on - circle.middle) + circle.middle), 0.1)


def test_swimmers_that_rest_stay_where_they_are() -> None:
    course = make_course("target", 2, fish=fish(), workers=1)
    course.begin(np.arange(2), np.random.default_rng(0))
    for _ in range(5):
        course.act(np.array([1.0, 1.0]), np.array([1]))
    assert course.time_s.tolist() == pytest.approx([0.0, 0.1])
    assert course.swimmers.crank[0][0] == 0.0 < course.swimmers.crank[0][1]


def test_wilsons_interval_is_the_published_one() -> None:
    """Newcombe, Stat. Med. 17 (1998), table I: 81 of 263."""
    hits = np.arange(263) < 81
    assert share(hits) == pytest.approx((81 / 263, 0.2553, 0.3662), abs=1e-4)
