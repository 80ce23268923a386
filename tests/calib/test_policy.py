"""`calib.policy`: what is trained is kept with its scores and swims; what does not fit is refused by name."""

from pathlib import Path

import numpy as np
import pytest

from calib import policy
from swimcal.errors import InputError
from swimgym.policy import SHIPPED, load_policy
from tests.swimgym.fish import session_with_fit


@pytest.fixture(scope="module")
def pool(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return session_with_fit(tmp_path_factory.mktemp("policies") / "pool")


def test_training_keeps_the_policy_its_scores_and_how_it_swam(pool: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(policy, "_train_policy", lambda *_: load_policy(SHIPPED / "circle"))
    found = policy.train(pool, "circle", effort="quick", workers=1, progress=False)
    assert found.file == pool / "results" / "policy" / "circle.npz"
    assert list(found.to_frame().index) == ["paper", "search"]
    assert load_policy(found.file).card.scores["episodes"] == 1
    with np.load(found.file.with_suffix(".swims.npz")) as swims:
        assert swims["reached"].all()
        assert swims["off_path_m"][0] < 0.01


def test_a_policy_of_another_task_and_another_kind_of_film_are_refused(pool: Path) -> None:
    with pytest.raises(InputError, match=r"a policy of another task; found circle; expected target"):
        policy.evaluate(pool, "target", SHIPPED / "circle.npz", episodes=1, workers=1)
    with pytest.raises(InputError, match=r"\.avi"):
        policy.play(pool, "swim.avi")
    with pytest.raises(InputError, match="there is no such policy"):
        policy.evaluate(pool, "target")
