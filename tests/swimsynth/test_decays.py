from functools import lru_cache

import numpy as np
import pytest

from swimcal.errors import SimulationDiverged
from swimcal.robot import load_robot
from swimsynth.simulate import TrueDecay, simulate_decays
from tests.swimsynth.plans import dry_plan

RELEASE_S = 0.507


@lru_cache(maxsize=1)
def decay() -> TrueDecay:
    (only,) = simulate_decays(dry_plan())
    return only


def test_the_tail_is_held_still_until_it_is_let_go() -> None:
    held = decay().time_s <= RELEASE_S
    moved = np.abs(decay().position_px - decay().position_px[0]).max(axis=(1, 2))

    assert moved[held].max() < 1e-6
    assert moved[~held][1] > 5.0


def test_a_decay_that_blows_up_is_reported() -> None:
    robot = load_robot().model_dump()
    robot["tail"] |= {"hinge_stiffness_n_m": 1e6, "hinge_damping_n_m_s": 1e-6}
    with pytest.raises(SimulationDiverged, match="trial decay: the free decay diverged"):
        simulate_decays(dry_plan(robot=type(load_robot()).model_validate(robot)))
