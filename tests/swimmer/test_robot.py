import numpy as np
import pytest

from swimmer import PUBLISHED_COEFFICIENTS
from tests.swimmer.robots import FISH


def test_segments_hinges_and_fin_of_the_default_stand_where_published() -> None:
    np.testing.assert_allclose(FISH.segment_x_m[:, 0], [0.292, 0.322, 0.354, 0.383, 0.404], atol=1e-12)
    np.testing.assert_allclose(np.diff(FISH.segment_x_m, axis=1), 0.015, atol=1e-12)
    np.testing.assert_allclose(FISH.hinge_x_m, [0.285, 0.3145, 0.3455, 0.376, 0.401], atol=1e-12)
    assert FISH.fin_root_x_m == pytest.approx(0.429)
    assert [s.half_height_m for s in FISH.tail.segment] == [0.05, 0.0475, 0.045, 0.0425, 0.04]
    assert [s.guide_offset_m for s in FISH.tail.segment] == [0.045, 0.035, 0.025, 0.015, 0.005]
    assert [s.tendon_crosses for s in FISH.tail.segment] == [False, False, False, True, True]


def test_crank_of_the_default_is_the_published_one() -> None:
    assert FISH.crank.position_m == (0.1655, 0.0, 0.0)
    assert FISH.crank.arm_m == 0.0395
    assert FISH.crank.anchor_radius_m == pytest.approx(0.0345)
    assert FISH.crank.anchor_offset_m == 0.055


def test_markers_of_the_default_sit_where_published() -> None:
    x_y = {name: marker.position_m[:2] for name, marker in FISH.markers.items()}
    middle = FISH.segment_x_m.mean(axis=1)
    expected = {
        "nose": (-0.077, 0.0),
        "neck": (0.065, 0.0),
        "pectoral_left": (0.1655, -0.0775),
        "pectoral_right": (0.1655, 0.0775),
        "dorsal_fin": (0.28, 0.0),
        **{f"tail_{i + 1}": (x, 0.0) for i, x in enumerate(middle)},
        "caudal_fin": (FISH.fin_root_x_m + 0.045, 0.0),
    }
    assert list(x_y) == list(expected)
    for name, place in expected.items():
        assert x_y[name] == pytest.approx(place), name
    assert FISH.scale_length_m == pytest.approx(0.142)


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
