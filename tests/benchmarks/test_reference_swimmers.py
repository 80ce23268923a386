import numpy as np

from benchmarks.reality import World
from benchmarks.reference_swimmers import ReferenceSwimmers
from swimgym import Course, Rules, Swimmers, Targets
from tests.swimgym.fish import WATER, fish


def test_they_swim_as_the_twin_does_in_the_same_water() -> None:
    others, twins = ReferenceSwimmers([World(tuple(WATER))]), Swimmers(fish().models, 1, workers=1)  # type: ignore[arg-type]
    np.testing.assert_allclose(others.centre_m, twins.centre_m, atol=5e-4)
    others.rest(np.arange(1))
    twins.rest(np.arange(1))
    for k in range(25):
        speed = np.array([min(12.0, 0.5 * k)])
        others.drive(speed)
        twins.drive(speed)
    np.testing.assert_allclose(others.crank[0], twins.crank[0], rtol=1e-2)
    np.testing.assert_allclose(others.tail[0], twins.tail[0], atol=0.03)
    np.testing.assert_allclose(others.head, twins.head, atol=0.01)
    assert not others.diverged.any()


def test_a_course_runs_on_them_and_who_rests_stays() -> None:
    others = ReferenceSwimmers([World(tuple(WATER))] * 2)  # type: ignore[arg-type]
    course = Course(others, Targets(2), Rules())
    course.begin(np.arange(2), np.random.default_rng(0))
    course.act(np.array([0.5, 0.5]), np.array([1]))
    np.testing.assert_allclose(others.crank[1], [0.0, 4.5])
    np.testing.assert_array_equal(others.head_rate[0], 0.0)
