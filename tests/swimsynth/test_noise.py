import numpy as np
import pytest

from swimsynth.disturbances import NOISELESS, TrackingNoise, lasting_errors, on_grid, placement_offsets

STEP_S = 1 / 60


def errors(noise: TrackingNoise, step_s: float = STEP_S, frames: int = 400, series: int = 400) -> np.ndarray:
    return lasting_errors((frames, series), step_s, noise, np.random.default_rng(1))


def correlation(values: np.ndarray, lag: int) -> float:
    return float((values[lag:] * values[: len(values) - lag]).mean() / (values**2).mean())


@pytest.mark.parametrize("sd_px", [0.2, 1.5])
@pytest.mark.parametrize("correlation_s", [0.0, 0.05, 0.3])
def test_errors_have_the_spread_asked_for_from_the_first_frame_on(sd_px: float, correlation_s: float) -> None:
    values = errors(TrackingNoise(sd_px=sd_px, correlation_s=correlation_s))

    assert values.std() == pytest.approx(sd_px, rel=0.03)
    assert values[0].std() == pytest.approx(sd_px, rel=0.1)
    assert values[-1].std() == pytest.approx(sd_px, rel=0.1)


@pytest.mark.parametrize("step_s", [1 / 240, 1 / 60, 1 / 20])
def test_correlation_falls_with_time_the_same_at_every_frame_rate(step_s: float) -> None:
    values = errors(TrackingNoise(correlation_s=0.1), step_s, frames=1000)

    for lag_s in (0.05, 0.1, 0.2):
        lag = round(lag_s / step_s)
        assert correlation(values, lag) == pytest.approx(np.exp(-lag_s / 0.1), abs=0.03)


PLACE_M = np.array([0.0, 0.1, 0.15, 0.4])


@pytest.mark.parametrize("shared", [0.3, 0.8, 1.0])
@pytest.mark.parametrize("length_m", [0.05, 0.4])
def test_neighbours_share_what_is_asked_for_in_each_axis(shared: float, length_m: float) -> None:
    noise = TrackingNoise(sd_px=0.7, correlation_s=0.02, shared=shared, shared_length_m=length_m)
    values = lasting_errors((20000, 4, 2), STEP_S, noise, np.random.default_rng(3), PLACE_M)
    seen = np.corrcoef(values.reshape(len(values), -1).T).reshape(4, 2, 4, 2)
    expected = shared * np.exp(-np.abs(PLACE_M[:, None] - PLACE_M) / length_m)
    np.fill_diagonal(expected, 1.0)

    np.testing.assert_allclose(seen[:, 0, :, 0], expected, atol=0.03)
    np.testing.assert_allclose(seen[:, 1, :, 1], expected, atol=0.03)
    np.testing.assert_allclose(seen[:, 0, :, 1], 0.0, atol=0.03)
    assert values.std() == pytest.approx(0.7, rel=0.03)
    assert correlation(values, 1) == pytest.approx(np.exp(-STEP_S / 0.02), abs=0.03)


def test_boxes_sit_off_their_markers_by_the_spread_asked_for() -> None:
    offsets = placement_offsets(5000, TrackingNoise(placement_sd_px=3.0), np.random.default_rng(2))

    assert offsets.shape == (5000, 2)
    np.testing.assert_allclose(offsets.std(axis=0), 3.0, rtol=0.05)


def test_the_grid_is_one_of_half_pixels() -> None:
    values = np.random.default_rng(0).uniform(0, 4000, 1000)

    assert set(on_grid(values, TrackingNoise()) % 1) == {0.0, 0.5}
    assert np.abs(on_grid(values, TrackingNoise()) - values).max() <= 0.25
    assert on_grid(values, NOISELESS) is values
