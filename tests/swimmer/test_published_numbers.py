"""Numbers of "Simple Models, Real Swimming" (2026) that the built-in robot should give, and how near it comes."""

import mujoco
import numpy as np
import pytest
from scipy.linalg import eigh

from swimmer import Twin, build_mjcf
from swimmer.mjcf import DRY, FREE_DECAY
from tests.swimmer.engine_state import at_pose, stretch
from tests.swimmer.robots import FISH
from tests.swimmer.swims import runs


def test_the_robot_weighs_what_was_published() -> None:
    """1.48 kg; the flexible gaps and the tendons have no mass here."""
    assert build_mjcf(FISH).compile().body_mass.sum() == pytest.approx(1.48, rel=0.05)


def test_the_robot_is_as_long_as_published() -> None:
    assert FISH.length_m == pytest.approx(0.57, abs=0.01)


def test_the_lowest_natural_frequency_in_air_without_tendons_is_within_a_fifth_of_the_published() -> None:
    """3.5 Hz published, 4.15 Hz here at the published hinge stiffness: our tail is the lighter one."""
    model = build_mjcf(FISH, scene=FREE_DECAY).compile()
    data, inertia = at_pose(model, {}), np.zeros((model.nv, model.nv))
    mujoco.mj_fullM(model, data, inertia)
    first = model.joint(FISH.hinges[0]).dofadr[0]
    stiffness = FISH.tail.hinge_stiffness_n_m * np.eye(len(FISH.hinges))
    lowest = np.sqrt(eigh(stiffness, inertia[first:, first:], eigvals_only=True)[0]) / (2 * np.pi)
    assert lowest == pytest.approx(3.5, rel=0.2)


@pytest.mark.parametrize("frequency_hz", [0.60, 1.19])
def test_tendons_change_their_length_by_less_than_the_published_three_per_cent(frequency_hz: float) -> None:
    """About 3 % in use published; 2 % in a dry run here, and shorter, not longer, than on the straight tail.

    The springs push as well as pull, so neither tendon goes slack; the difference is left to the diagnosis.
    """
    time_s = np.arange(1.0, 1.0 + 1 / frequency_hz, 1 / 60)
    swum = Twin(FISH, scene=DRY).simulate(runs(frequency_hz), time_s)
    model = build_mjcf(FISH, scene=DRY).compile()
    both = np.array(
        [stretch(model, FISH, c, h) for c, h in zip(swum.crank_rad[0], swum.hinges_rad[0], strict=True)]
    )  # (f, 2)
    for tendon in both.T:
        assert 0.015 < np.ptp(tendon) < 0.03
        assert tendon.max() < 1e-3
