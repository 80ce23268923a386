from functools import lru_cache
from pathlib import Path

import numpy as np
import pytest

from fitting.free_decay import fit_decay, measure_decay_trial
from session import load_session
from session.errors import SimulationDiverged
from swimmer import load_robot
from synthetic import make_session, read_truth
from synthetic.decays import TrueDecay, simulate_decays
from tests.synthetic.plans import dry_plan, tracks_of

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


def test_stiffness_and_damping_are_found_in_its_tracks(tmp_path: Path) -> None:
    folder = make_session(tmp_path / "s", dry_plan())
    session, truth = load_session(folder), read_truth(folder)
    spec, robot = session.trial("decay"), load_robot()
    trial = measure_decay_trial(spec.name, tracks_of(session, spec.name), session.camera, robot)
    fit = fit_decay(trial, robot)

    assert (spec.kind, spec.role, spec.commanded_hz, spec.motor) == ("free_decay", "fit", None, None)
    assert trial.release_s == pytest.approx(RELEASE_S, abs=1 / 60)
    assert fit.stiffness_n_m == pytest.approx(truth.structure.hinge_stiffness_n_m, rel=0.01)
    assert fit.damping_n_m_s == pytest.approx(truth.structure.hinge_damping_n_m_s, rel=0.1)
    assert fit.flags == ()


def test_a_decay_that_blows_up_is_told() -> None:
    robot = load_robot().model_dump()
    robot["tail"] |= {"hinge_stiffness_n_m": 1e6, "hinge_damping_n_m_s": 1e-6}
    with pytest.raises(SimulationDiverged, match="trial decay: the free decay diverged"):
        simulate_decays(dry_plan(robot=type(load_robot()).model_validate(robot)))
