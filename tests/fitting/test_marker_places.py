"""What is wrong with one swim shows beside the others: a marker off its place, a camera that moves."""

from functools import cache
from pathlib import Path

import numpy as np
import pytest

from fitting.left_out import carried_swims, odd_markers
from fitting.measure_trial import measure_trial
from fitting.trial import MeasuredTrial
from swimcal.create_session import FISHSIM_MARKERS
from swimcal.robot import load_robot
from swimcal.session import TrialSpec
from swimcal.session_file import CameraSpec
from swimcal.tracks import as_tracks, load_tracks, pixels_of

SAMPLE = Path(__file__).resolve().parents[2] / "datasets" / "sample" / "trials"
ROBOT = load_robot()
HZ = {"f0_60": 0.6, "f0_80": 0.8, "f1_30": 1.3}


@cache
def swum(
    name: str, marker: str = "", along: float = 0.0, across: float = 0.0, moved_px_s: tuple[float, float] = (0.0, 0.0)
) -> MeasuredTrial:
    """A trial of the sample, one marker so many mm from its place, seen from the head; the camera moves."""
    tracks = load_tracks(SAMPLE / f"{name}.csv.gz", FISHSIM_MARKERS, 60.0)
    position_px = pixels_of(tracks).copy()
    if marker:
        head = position_px[:, 1] - position_px[:, 0]
        aside = np.stack([-head[:, 1], head[:, 0]], axis=1)
        position_px[:, FISHSIM_MARKERS.index(marker)] += (along * head + across * aside) / (1000 * ROBOT.scale_length_m)
    position_px += tracks.time.values[:, None, None] * np.array(moved_px_s)
    moved = as_tracks(FISHSIM_MARKERS, tracks.time.values, position_px, tracks.confidence.values)
    camera = CameraSpec(60.0, ROBOT.scale_length_m)
    return measure_trial(TrialSpec(name, "swim", commanded_hz=HZ[name]), moved, camera, ROBOT, 1.0)


@pytest.mark.long
def test_nothing_is_said_of_clean_swims() -> None:
    assert odd_markers([swum(name) for name in HZ], ROBOT) == {}


@pytest.mark.parametrize(
    ("marker", "along", "across"),
    [("tail_3", 0.0, 30.0), ("dorsal_fin", -30.0, 0.0), ("tail_5", 0.0, -30.0), ("neck", 0.0, 40.0)],
)
def test_a_marker_off_its_place_in_one_swim_is_named(marker: str, along: float, across: float) -> None:
    trials = [swum("f0_60"), swum("f0_80"), swum("f1_30", marker, along, across)]
    ((name, flag),) = odd_markers(trials, ROBOT).items()
    assert (name, flag.kind, flag.markers) == ("f1_30", "markers_off", (marker,))
    assert flag.frames == (0, len(trials[2].time_s) - 1)
    mm = float(flag.message.removeprefix(f"{marker} sits ").split()[0])
    assert mm == pytest.approx(np.hypot(along, across), abs=10.0)
    assert "in the whole of f1_30" in flag.message


def test_of_two_swims_nobody_knows_which_is_the_odd_one() -> None:
    assert odd_markers([swum("f0_60"), swum("f1_30", "tail_3", 0.0, 30.0)], ROBOT) == {}


@pytest.mark.parametrize("moved_px_s", [(0.0, 50.0), (30.0, -50.0), (-20.0, 60.0)])
def test_a_swim_whose_camera_moves_is_carried(moved_px_s: tuple[float, float]) -> None:
    """It heads to the left of the picture."""
    trials = [swum("f0_60"), swum("f1_30"), swum("f0_80", moved_px_s=moved_px_s)]
    ((name, flag),) = carried_swims(trials).items()
    assert (name, flag.kind, flag.markers) == ("f0_80", "carried", ())
    mm_s = float(flag.message.partition(" mm/s")[0].split()[-1])
    assert mm_s == pytest.approx(abs(moved_px_s[1]) * 1000 * trials[2].metres_per_px, abs=12.0)
    assert carried_swims(trials[::-1]) == {name: flag}


def test_clean_swims_are_not_carried_and_of_two_nobody_knows_which() -> None:
    assert carried_swims([swum(name) for name in HZ]) == {}
    assert carried_swims([swum("f0_60"), swum("f0_80", moved_px_s=(0.0, 50.0))]) == {}
