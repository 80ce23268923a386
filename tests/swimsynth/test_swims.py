import numpy as np
import pytest

from swimcal.errors import InputError
from swimcal.mjcf import Scene
from swimcal.runs import Runs
from swimcal.session_file import CameraSpec
from swimcal.tracks import as_tracks
from swimcal.twin import Twin
from swimsynth.plan import SyntheticPlan
from swimsynth.simulate import TrueRun, simulate_swims
from tests.swimsynth.plans import small_plan
from tracking.camera import to_pool
from tracking.head_frame import HeadFrame, to_head_frame

HEADING_RAD = 0.4


def head_frame_of(swim: TrueRun, plan: SyntheticPlan) -> HeadFrame:
    """The head frame that the program finds in the pixels of a swim."""
    confidence = np.ones(swim.position_px.shape[:2])
    tracks = as_tracks(plan.markers, swim.time_s, swim.position_px, confidence)
    position_m, _ = to_pool(tracks, CameraSpec(plan.camera.fps, plan.swimmer.scale_length_m))
    return to_head_frame(position_m, plan.markers.index("nose"), plan.markers.index("neck"))


def test_the_pixels_show_the_swim_of_the_twin() -> None:
    """Not its mirror image, and from the planned crank phase and heading on."""
    plan = small_plan(slow={"heading_rad": HEADING_RAD}, run_in_s=0.0, start_speed_m_s=0.1)
    trial, swim = plan.trials[0], simulate_swims(plan)[0]
    runs = Runs(
        coefficients=np.array([plan.coefficients], float),
        frequency_hz=np.array([trial.frequency_hz]),
        phase_rad=np.array([trial.phase_rad]),
        velocity=np.array([[-0.1, 0.0, 0.0]]),
    )
    twin = Twin(plan.swimmer, plan.markers, Scene(timestep_s=plan.timestep_s))
    expected = to_head_frame(twin.simulate(runs, swim.time_s).marker_m[0], 0, 1)
    found = head_frame_of(swim, plan)

    np.testing.assert_allclose(found.position_m, expected.position_m, atol=1e-9)
    towards_neck = HEADING_RAD + np.pi
    assert np.exp(1j * found.heading_rad[0]) == pytest.approx(np.exp(1j * towards_neck), abs=1e-9)
    assert swim.phase_rad == pytest.approx(trial.phase_rad, abs=1e-6)


def test_the_truth_of_a_swim_is_that_of_the_simulated_crank_and_nose() -> None:
    plan = small_plan(run_in_s=8.0)
    for swim in simulate_swims(plan):
        forward_m = head_frame_of(swim, plan).forward_m
        beats = int(swim.time_s[-1] * swim.frequency_hz)
        end = round(beats * plan.camera.fps / swim.frequency_hz)
        assert swim.speed_m_s == pytest.approx(forward_m[end] / swim.time_s[end], rel=0.03)
        assert swim.frequency_hz == pytest.approx(swim.trial.frequency_hz, rel=1e-3)
        assert np.angle(np.exp(1j * (swim.phase_rad - swim.trial.phase_rad))) == pytest.approx(0, abs=0.05)
        assert 0 <= swim.phase_rad < 2 * np.pi


def test_a_swim_that_leaves_the_image_is_refused_with_the_way_out() -> None:
    with pytest.raises(InputError) as caught:
        simulate_swims(small_plan(slow={"start_px": (20.0, 1000.0), "heading_rad": np.pi}))

    message = str(caught.value)
    assert "trial slow: the fish leaves the image; found x -" in message
    assert "expected x 0 to 3839, y 0 to 2159 px" in message
    assert "leave start_px out to centre it" in message
