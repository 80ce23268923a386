import numpy as np

from calib.capture.trials import CHIP_S, CHIP_TURNS_PER_S, END_CODE, START_CODE


def test_a_code_agrees_with_itself_in_one_place_only() -> None:
    for code in (START_CODE, END_CODE):
        lobes = np.abs(np.correlate(code, code, "full"))  # (31,)
        assert lobes.max() == 16
        assert np.sort(lobes)[-2] <= 3


def test_the_crank_ends_where_it_began_within_a_fifth_of_a_turn_on_the_way() -> None:
    turns = np.cumsum(START_CODE) * CHIP_S * CHIP_TURNS_PER_S
    assert turns[-1] == 0
    assert np.ptp([0, *turns]) <= 0.2
