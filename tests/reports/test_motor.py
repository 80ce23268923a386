"""The motor in the report: on the clock of the video, its uneven turn and its flags shown."""

import numpy as np
import pytest
from matplotlib.colors import to_hex

from reports.context import BINS
from reports.page import Table
from reports.robot import build_motor, build_structure, motor_section, motor_speed_figure
from reports.style import EBT
from tests.reports.motors import SWING, made_logged
from tests.reports.sample import made_context


@pytest.mark.parametrize("forward", [1.0, -1.0])
def test_the_speed_through_a_turn_is_that_of_the_crank_whichever_way_it_turns(forward: float) -> None:
    turns = made_logged(forward=forward).turns
    angle = 2 * np.pi * np.arange(BINS) / BINS
    speed = 1 / (1 - SWING * np.cos(angle))

    assert len(turns) == 2  # whole ones within the drive
    np.testing.assert_allclose(turns, np.broadcast_to(speed, turns.shape), atol=0.004)


def test_command_codes_and_speed_lie_on_the_clock_of_the_video() -> None:
    trial = made_logged()
    (axes,) = motor_speed_figure([trial]).axes
    (reported,) = [line for line in axes.lines if to_hex(line.get_color()) == EBT]

    np.testing.assert_allclose(trial.codes, [(0.5, 1.5), (8.5, 9.5)])
    np.testing.assert_allclose(reported.get_xdata()[:-1], [0.0, 0.5, 1.5, 2.0, 8.0, 8.5, 9.5], atol=1e-9)
    assert max(reported.get_ydata()) == pytest.approx(0.6 / 0.98)
    assert axes.get_xlim() == pytest.approx((0.0, 9.99))


def test_the_section_tells_speeds_clock_and_load() -> None:
    section = motor_section((made_logged("dry_slow", kind="dry"), made_logged()))
    turning, supply = (block for block in section.blocks if isinstance(block, Table))

    assert turning.rows[0] == (
        "dry_slow", "dry run", "0.612", "0.6000", "−2.00", "5.00", "3.000 ± 0.001", "1000 ± 20", "code"
    )  # fmt: skip
    assert supply.rows[1] == ("f0_60", "100", "0.80", "0.80", "11.9", "11.9", "25 to 31", "none")
    assert "speed swings by up to ±5.0 %" in section.blocks[0].text  # type: ignore[union-attr]
    assert "off the command by up to 2.0 %" in section.blocks[0].text  # type: ignore[union-attr]


def test_a_log_whose_clock_is_not_known_is_shown_but_not_followed() -> None:
    lost = made_logged("lost", coded=False, usable=False)
    both, alone = motor_section((made_logged(), lost)), motor_section((lost,))

    assert "but not in lost, where the log is not used" in both.blocks[0].text  # type: ignore[union-attr]
    assert both.blocks[1].rows[1][-1] == "given, not used"  # type: ignore[union-attr]
    assert "every crank is taken to turn evenly" in alone.blocks[0].text  # type: ignore[union-attr]


def test_a_log_of_another_time_than_the_video_still_draws() -> None:
    section = motor_section((made_logged(coded=False, drive_s=(50.0, 60.0), usable=False),))

    assert section.blocks[-1].rows[0][2] == "–"  # type: ignore[union-attr]


def test_without_a_log_there_is_no_section_and_the_turn_is_reported_to_be_assumed() -> None:
    context = made_context()

    assert build_motor(context) is None
    last = build_structure(context).blocks[0].rows[-1]  # type: ignore[union-attr]
    assert last[0] == "crank angle"
    assert last[-1].startswith("assumed: turns evenly")
