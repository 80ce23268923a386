"""Needs the extra `swimcal[policies]`, and skips without it."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from swimgym.course import make_course
from swimgym.policy import features, load_policy
from tests.swimgym.fish import fish

pytest.importorskip("stable_baselines3")


@pytest.mark.long
@pytest.mark.filterwarnings("ignore")  # warnings that torch gives
def test_a_network_is_trained_goes_on_and_acts_without_torch(tmp_path: Path) -> None:
    import torch
    from stable_baselines3 import SAC

    from swimgym.sac import SacPlan, train_sac

    size: Any = {"swimmers": 4, "hold": 2, "updates": 1, "layers": (8, 8), "warmup": 20, "every": 40}
    state, told = tmp_path / "target.sac.zip", list[float | None]()
    train_sac(fish(), "target", SacPlan(steps=80, **size), state_file=state, workers=1)
    plan = SacPlan(steps=120, **size)
    trained = train_sac(
        fish(), "target", plan, state_file=state, workers=1, progress=lambda _message, share: told.append(share)
    )
    assert told == [1.0]  # from 80 to 120 choices
    trained.save(tmp_path / "target.npz")
    course = make_course("target", 3, fish=fish(), workers=1)
    seen = course.begin(np.arange(3), np.random.default_rng(0))
    beat = np.tanh(trained._through(features(seen)))
    with torch.no_grad():
        own = SAC.load(state).policy.actor(torch.as_tensor(features(seen)), deterministic=True).numpy()
    np.testing.assert_allclose(beat, own, atol=1e-5)
    np.testing.assert_array_equal(load_policy(tmp_path / "target.npz").act(seen), trained.act(seen))
