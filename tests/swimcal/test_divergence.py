"""What diverges raises or is flagged, and what need not diverge does not."""

from dataclasses import replace
from pathlib import Path

import mujoco
import numpy as np
import pytest
from mujoco.batch import Batch

from swimcal.errors import SimulationDiverged
from swimcal.mjcf import PUBLISHED_COEFFICIENTS, SWIM, build_mjcf
from swimcal.robot import RobotSpec
from swimcal.runs import Runs, Trajectories
from swimcal.twin import Twin
from tests.swimcal.robots import FISH, THREE_LINK
from tests.swimcal.swims import runs, sobol_runs

FRAMES = np.arange(0, 4, 1 / 30)
EXPLODING = (0.0, 0.0, 0.0, 1e4, 0.0)


@pytest.fixture(autouse=True)
def _elsewhere(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The engine writes a log of its warnings into the current folder."""
    monkeypatch.chdir(tmp_path)


def assert_plausible(swum: Trajectories) -> None:
    assert np.isfinite(swum.marker_m).all()
    assert np.abs(swum.hinges_rad).max() < np.pi / 2
    assert np.abs(np.diff(swum.head[..., :2], axis=1)).max() < 5.0 / 30


def test_a_simulation_that_blows_up_raises_and_says_which() -> None:
    three = runs([1.0, 1.0, 2.0], coefficients=[PUBLISHED_COEFFICIENTS, EXPLODING, PUBLISHED_COEFFICIENTS])
    with pytest.raises(SimulationDiverged) as caught:
        Twin(FISH).simulate(three, FRAMES)
    assert str(caught.value) == (
        "1 of 3 simulations diverged; the first at coefficients [0, 0, 0, 1e+04, 0], 1 Hz. Expected a bounded "
        "motion; try a smaller time_step_s in the robot's file, or keep the coefficients within [0, 10]."
    )
    assert caught.value.exit_code == 2


def test_if_allowed_it_is_flagged_and_nan_and_the_others_are_untouched() -> None:
    three = runs([1.0, 1.0, 2.0], coefficients=[PUBLISHED_COEFFICIENTS, EXPLODING, PUBLISHED_COEFFICIENTS])
    swum = Twin(FISH).simulate(three, FRAMES, allow_divergence=True)
    np.testing.assert_array_equal(swum.diverged, [False, True, False])
    for array in (swum.marker_m, swum.head, swum.hinges_rad, swum.crank_rad):
        assert np.isnan(array[1]).all()
        assert np.isfinite(array[[0, 2]]).all()
    np.testing.assert_array_equal(swum.marker_m[0], Twin(FISH).simulate(runs(1.0), FRAMES).marker_m[0])


@pytest.mark.parametrize("timestep_s", [0.05, 0.1])
def test_a_time_step_that_the_tendons_cannot_bear_raises_before_any_swim(timestep_s: float) -> None:
    twin = Twin(FISH, scene=replace(SWIM, timestep_s=timestep_s))
    with pytest.raises(SimulationDiverged) as caught:
        twin.simulate(runs(1.0), FRAMES, allow_divergence=True)
    text = str(caught.value)
    assert text.startswith("The tail of fish_057 cannot be brought into its starting poses")
    assert f"with steps of {timestep_s:g} s" in text
    assert "try a smaller time_step_s in the robot's file, softer tendons" in text


def exported(robot: RobotSpec, points: Runs) -> np.ndarray:
    """(n, steps, nq) motion of the exported file alone, from a straight tail with the crank already turning."""
    spec = build_mjcf(robot)
    spec.compile()
    model = mujoco.MjModel.from_xml_string(spec.to_xml())
    batch = Batch(model, len(points))
    wet = np.flatnonzero(model.geom_fluid[:, 0] > 0)
    batch.expand("geom_fluid")[:, wet, 1:6] = points.coefficients[:, None]
    crank = model.joint("crank")
    batch.bind("qpos")[:, crank.qposadr[0]] = points.phase_rad
    batch.bind("ctrl")[:, 0] = batch.bind("qvel")[:, crank.dofadr[0]] = 2 * np.pi * points.frequency_hz
    return batch.rollout(round(4.0 / model.opt.timestep), record=("qpos",))["qpos"]


@pytest.mark.long
def test_none_of_4096_sobol_points_diverges_in_the_exported_file_from_a_straight_tail() -> None:
    """One of them, at extreme lift, jumps once at steps of 4.5 ms and swims on; at 4 ms none does."""
    points, jumps = sobol_runs(n := 4096), 0
    for first in range(0, n, 256):
        rows = slice(first, first + 256)
        part = Runs(points.coefficients[rows], points.frequency_hz[rows], points.phase_rad[rows])
        motion = exported(FISH, part)
        assert np.isfinite(motion).all()
        assert np.abs(motion[..., 4:]).max() < np.pi / 2
        speed = np.abs(np.diff(motion[..., :2], axis=1)).max(axis=(1, 2)) / SWIM.timestep_s
        jumps += (speed > 5.0).sum()
        turned = motion[:, -1, 3] - part.phase_rad
        np.testing.assert_allclose(turned, 2 * np.pi * part.frequency_hz * 4.0, rtol=0.05)
    assert jumps <= 1


@pytest.mark.long
def test_none_of_4096_sobol_points_diverges_in_the_twin() -> None:
    assert_plausible(Twin(FISH).simulate(sobol_runs(4096), FRAMES))


def test_a_plain_mujoco_shows_a_state_that_blew_up_instead_of_resetting_it() -> None:
    spec = build_mjcf(THREE_LINK)
    spec.compile()
    model = mujoco.MjModel.from_xml_string(spec.to_xml())
    model.tendon_stiffness[:] = 1e9
    data = mujoco.MjData(model)
    data.ctrl[0] = data.joint("crank").qvel[0] = 10.0
    data.joint("crank").qpos[0] = 1.0
    mujoco.mj_step(model, data, 500)
    assert not (np.abs(data.qpos) < 1e3).all()
    assert data.time == pytest.approx(500 * model.opt.timestep)
