"""Dry runs, free decays and motor logs in the report: the numbers that were fitted, the figures whole, flags shown."""

import numpy as np
import pytest
from matplotlib.colors import to_hex

from fitting.decay_fit import fit_decay
from fitting.free_decay import measure_decay_trial
from fitting.hinges import DecayFit, combine_decays
from fitting.structure import Source, Structure
from reports.context import BINS
from reports.dry_experiments import crank_surface_figure, decay_curve_figure, dry_run_section, free_decay_section
from reports.page import Prose, Table
from reports.robot import motor_section, motor_speed_figure
from reports.style import EBT, TWIN
from tests.fitting.free_decay.decays import CAMERA, ROBOT, Truth, decay_tracks
from tests.reports.whole import SWING, made_crank, made_logged, made_run


def test_both_estimates_stand_on_the_surface() -> None:
    figure = crank_surface_figure(made_crank(made_run("dry", 0.6, 0.1)))
    speed, phase = figure.axes
    places = [tuple(np.round(np.array(line.get_data())[:, 0].astype(float), 2)) for line in speed.get_lines()[:2]]

    assert places == [(39.1, 0.6), (38.4, 0.6)]
    low, high = phase.get_ylim()
    assert low < np.degrees(0.1) < high  # the fitted phase is in the middle, wherever a turn begins
    assert high - low == pytest.approx(360.0)


def test_the_section_gives_both_arms_and_a_row_a_run() -> None:
    section = dry_run_section(made_crank())
    prose = [block.text for block in section.blocks if isinstance(block, Prose)]
    (table,) = [block for block in section.blocks if isinstance(block, Table)]

    assert "Both dry runs together give a crank arm of 38.40 ± 0.06 mm" in prose[0]
    assert "39.10 mm and 39.10 mm; their mean, 39.10 mm, is the published estimate" in prose[0]
    assert table.rows[0][:5] == ("dry_slow", "0.612", "0.6000 ± 0.0002", "−2.0", "5.7 ± 0.2")
    assert len(table.columns) == len(table.rows[0])
    assert "stretch by up to 0.0 % (published: about 3 %)" in prose[1]


@pytest.fixture(scope="module")
def fit() -> DecayFit:
    tracks = decay_tracks(Truth(damping_n_m_s=0.006))
    return fit_decay(measure_decay_trial("decay_1", tracks, CAMERA, ROBOT), ROBOT, workers=1)


def structure_of(*fits: DecayFit, believed: tuple[str, ...] = ("decay_1",)) -> Structure:
    """A structure of these decays, of which only some are believed."""
    used = [fit for fit in fits if fit.name in believed]
    hinges = combine_decays(used) if used else None
    source = Source("hinge_stiffness", 0.65, "N m/rad", 0.004 if used else None, believed, "")
    return Structure(ROBOT, fits, hinges, None, (source,))


def test_every_marker_is_drawn_next_to_the_twin(fit: DecayFit) -> None:
    lines = [line for line in decay_curve_figure(fit).axes[0].lines if len(line.get_xdata())]

    twin = [line.get_ydata() for line in lines if to_hex(line.get_color()) == TWIN]
    np.testing.assert_allclose(np.array(twin).T, fit.simulated_m * 1000)


def test_without_a_decay_to_believe_it_says_that_the_hinges_are_assumed(fit: DecayFit) -> None:
    section = free_decay_section(structure_of(fit, believed=()))

    assert section.blocks[0].text.startswith("No free decay can be believed")  # type: ignore[union-attr]
    assert section.blocks[1].rows[0][-1] == "no"  # type: ignore[union-attr]


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


def test_a_log_whose_clock_is_not_known_is_shown_but_not_followed() -> None:
    lost = made_logged("lost", coded=False, usable=False)
    both, alone = motor_section((made_logged(), lost)), motor_section((lost,))

    assert "but not in lost, where the log is not used" in both.blocks[0].text  # type: ignore[union-attr]
    assert both.blocks[1].rows[1][-1] == "given, not used"  # type: ignore[union-attr]
    assert "every crank is taken to turn evenly" in alone.blocks[0].text  # type: ignore[union-attr]


def test_a_log_of_another_time_than_the_video_still_draws() -> None:
    section = motor_section((made_logged(coded=False, drive_s=(50.0, 60.0), usable=False),))

    assert section.blocks[-1].rows[0][2] == "–"  # type: ignore[union-attr]
