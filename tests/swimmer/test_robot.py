import pytest

from swimmer import PUBLISHED_COEFFICIENTS
from tests.swimmer.robots import FISH


def test_the_default_is_as_long_as_published() -> None:
    assert FISH.length_m == pytest.approx(0.57, abs=0.01)


def test_published_coefficients_are_in_the_engines_order() -> None:
    assert PUBLISHED_COEFFICIENTS == (0.40, 7.79, 2.81, 3.84, 0.27)
    assert PUBLISHED_COEFFICIENTS._fields == (
        "blunt_drag",
        "slender_drag",
        "angular_drag",
        "kutta_lift",
        "magnus_lift",
    )
