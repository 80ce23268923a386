"""Given boxes against the robot: real ones pass, however the tail bends; orders and spacings that cannot be do not."""

from itertools import pairwise

import numpy as np
import pytest

from swimcal.errors import FaultCollector
from swimcal.tracks import load_tracks, pixels_of
from tests.swimcal.sample import FISHSIM, needs_fishsim
from tests.tracking.boxes.drawn import ELEVEN, NINE, Scene, layout, places_px
from tracking.boxes import check_layout

TRIALS = ("f0_50", "f0_75", "f1_00", "f1_25", "f1_75")
BENT = Scene(bend_deg=(20, 25, 25, 20, 15), heading_deg=70.0)


def faults(centre_px: np.ndarray, markers: tuple[str, ...] = NINE) -> str:
    collector = FaultCollector("f1.boxes.json")
    check_layout(markers, centre_px, layout(markers), collector)
    return "\n".join(map(str, collector.faults))


def exchanged(centre_px: np.ndarray, one: str, other: str, markers: tuple[str, ...] = NINE) -> np.ndarray:
    order = list(range(len(markers)))
    a, b = markers.index(one), markers.index(other)
    order[a], order[b] = b, a
    return centre_px[order]


@needs_fishsim
@pytest.mark.parametrize("trial", TRIALS)
def test_real_start_boxes_pass_and_exchanged_ones_are_refused(trial: str) -> None:
    centre_px = pixels_of(load_tracks(FISHSIM / f"{trial}.csv", NINE, 60.0))[0]
    assert faults(centre_px) == ""
    for one, other in pairwise(NINE):
        if (one, other) != ("dorsal_fin", "tail_1"):  # on the real robot 40 to 64 mm apart instead of 20
            assert f"Exchange {one} and {other}" in faults(exchanged(centre_px, one, other))


@pytest.mark.parametrize("markers", [NINE, ELEVEN])
@pytest.mark.parametrize("heading_deg", [0.0, 130.0, 180.0, -60.0])
@pytest.mark.parametrize("px_per_m", [300.0, 1500.0])
def test_a_bent_robot_passes_at_any_heading_and_scale(
    markers: tuple[str, ...], heading_deg: float, px_per_m: float
) -> None:
    assert faults(places_px(BENT.but(markers=markers, heading_deg=heading_deg, px_per_m=px_per_m)), markers) == ""


def test_what_was_found_and_what_is_expected_is_reported_in_mm_and_degrees() -> None:
    found = faults(exchanged(places_px(Scene()), "tail_3", "tail_1"))
    assert "f1.boxes.json: boxes.tail_2: no place for tail_2 behind tail_1" in found
    assert "found 32 mm from it, at 180 degrees to the way from neck to dorsal_fin; expected 13 to 72 mm" in found
    assert "108 degrees or less" in found
    assert "Exchange tail_1 and tail_3" in found


def test_left_and_right_exchanged_are_refused() -> None:
    assert "pectoral_left" in faults(
        exchanged(places_px(Scene(markers=ELEVEN)), "pectoral_left", "pectoral_right", ELEVEN), ELEVEN
    )


def test_a_box_far_from_the_body_is_refused_by_name_without_a_guess() -> None:
    centre_px = places_px(Scene())
    centre_px[NINE.index("tail_3")] += [0.0, 250.0]
    found = faults(centre_px)
    assert "boxes.tail_3" in found
    assert "Exchange" not in found
    assert "calib track SESSION --click" in found


def test_with_three_markers_in_a_row_nothing_can_be_reported() -> None:
    few = ("nose", "neck", "tail_1")
    assert faults(np.array([[0.0, 0.0], [50.0, 0.0], [-400.0, 9.0]]), few) == ""
