import numpy as np

from calib.capture.plan import CHIP_S, CHIP_TURNS_PER_S, END_CODE, START_CODE


def test_a_code_agrees_with_itself_in_one_place_only() -> None:
    for code in (START_CODE, END_CODE):
        lobes = np.abs(np.correlate(code, code, "full"))  # (31,)
        assert lobes.max() == 16
        assert np.sort(lobes)[-2] <= 3


def test_the_crank_ends_where_it_began_within_a_fifth_of_a_turn_on_the_way() -> None:
    turns = np.cumsum(START_CODE) * CHIP_S * CHIP_TURNS_PER_S
    assert turns[-1] == 0
    assert np.ptp([0, *turns]) <= 0.2


def test_the_offset_comes_back_from_a_delayed_and_noisy_copy() -> None:
    rng = np.random.default_rng(0)
    step_s = 1 / 60
    wave = np.repeat(START_CODE, round(CHIP_S / step_s)).astype(float)
    for frames in (0, 37, 211):
        seen = np.concatenate([np.zeros(frames), wave, np.zeros(120)])
        seen += 0.5 * rng.standard_normal(seen.size)
        assert abs(int(np.argmax(np.correlate(seen, wave, "valid"))) - frames) <= 1
