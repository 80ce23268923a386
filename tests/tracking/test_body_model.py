import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.tracking.fish import MARKERS, PX_PER_M, ROBOT
from tracking.body_model import BodyModel, JointGaussian, centred, fit_body_model, layout_model, rows_alike

PLACE_M = ROBOT.marker_positions_m(MARKERS)
M = len(MARKERS)


def prior() -> BodyModel:
    return layout_model(PLACE_M, root_x_m=0.28, px_per_m=PX_PER_M, unit_m=0.142)


def drawn(model: BodyModel, frames: int, seed: int) -> np.ndarray:
    """(n, 2m) deviations from the model's mean."""
    rng = np.random.default_rng(seed)
    return rng.multivariate_normal(np.zeros(2 * M), model.covariance_px2, frames)


@given(st.integers(0, 10**6), st.integers(1, 4))
def test_leaving_one_out_is_the_distance_from_what_the_others_let_expect(seed: int, markers: int) -> None:
    rng = np.random.default_rng(seed)
    m = markers + 1
    root = rng.normal(size=(2 * m, 2 * m))
    gaussian = JointGaussian(root @ root.T + 0.1 * np.eye(2 * m))
    deviation = rng.normal(size=2 * m)
    distance, spread = gaussian.leave_one_out(deviation, np.ones(m, dtype=bool))
    for k in range(m):
        others = np.arange(m) != k
        expected = gaussian.expected(deviation, others).reshape(m, 2)[k]
        assert distance[k] == pytest.approx(deviation.reshape(m, 2)[k] - expected, rel=1e-6, abs=1e-6)
        assert spread[k] == pytest.approx(gaussian.spread_given(others)[k], rel=1e-5)


@given(st.floats(-3, 3), st.floats(0.5, 2), st.floats(-500, 500), st.floats(-500, 500))
def test_the_pose_takes_off_place_heading_and_size(turn: float, size: float, x: float, y: float) -> None:
    model = prior()
    rotation = np.array([[np.cos(turn), np.sin(turn)], [-np.sin(turn), np.cos(turn)]])
    position = (size * model.place_px @ rotation + [x, y])[None]
    pose = model.pose(position, np.ones((1, M), dtype=bool))
    assert model.to_body(position, pose) == pytest.approx(0, abs=1e-4)


def test_a_learned_model_predicts_better_than_the_layout() -> None:
    layout = prior()
    tight = BodyModel(layout.place_px, np.full(2 * M, 4.0), layout.covariance_px2 / 9)
    position = layout.place_px + (tight.mean_px + drawn(tight, 400, seed=3)).reshape(-1, M, 2)
    active = np.random.default_rng(4).random((400, M)) < 0.9
    model = fit_body_model(layout, position, active)
    everyone = np.ones(M, dtype=bool)
    _, spread = model.shape_and_pose.leave_one_out(np.zeros(2 * M), everyone)
    _, true = tight.shape_and_pose.leave_one_out(np.zeros(2 * M), everyone)
    assert spread == pytest.approx(true, rel=0.35)


def test_a_box_in_the_wrong_place_for_nearly_half_of_a_trial_does_not_draw_the_mean() -> None:
    layout = prior()
    position = layout.place_px + np.random.default_rng(6).normal(0, 0.7, (200, M, 2))
    hopping = position.copy()
    hopping[:90, 6] += [-14.0, 8.0]
    active = np.ones((200, M), dtype=bool)
    model = centred(layout, hopping, active)
    active[:90, 6] = False
    put = model.put_by_others(hopping, active)
    near = slice(5, 8)
    assert np.median((hopping - put)[90:, near], axis=0) == pytest.approx(np.zeros((3, 2)), abs=2.0)
    assert np.median((position - put)[:90, 6], axis=0) == pytest.approx(np.zeros(2), abs=2.0)


@pytest.mark.parametrize("seed", range(20))
def test_rows_are_grouped_by_their_pattern(seed: int) -> None:
    random = np.random.default_rng(seed)
    active = random.random(random.integers(1, 8, 2)) > 0.5
    groups = list(rows_alike(active))

    assert sorted(np.concatenate([rows for _, rows in groups])) == list(range(len(active)))
    assert all((active[rows] == mask).all() for mask, rows in groups)
    np.testing.assert_array_equal([mask for mask, _ in groups], np.unique(active, axis=0))
