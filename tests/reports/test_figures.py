"""Figures show what was measured, and nothing they should not."""

from dataclasses import replace

import numpy as np
import pytest
from matplotlib.colors import to_hex
from matplotlib.figure import Figure

from reports.figures import (
    beat_midlines,
    coefficients_figure,
    convergence_figure,
    flagged_samples_figure,
    forward_path_figure,
    lateral_motion_figure,
    planform_figure,
    speed_errors_figure,
    speed_sweep_figure,
    tail_envelope_figure,
)
from reports.figures.coefficients import coefficients_at_bound
from reports.figures.flagged_samples import flagged_kinds
from reports.figures.time_windows import runs
from reports.style import TWIN
from swimmer import load_robot
from tests.reports.sample import MARKERS, made_calibration, made_fit, made_trial

ROBOT = load_robot()


@pytest.mark.parametrize(
    "figure",
    [
        lambda: speed_sweep_figure(made_calibration()),
        lambda: speed_errors_figure(made_calibration()),
        lambda: tail_envelope_figure(made_trial(ROBOT, "slow", flagged=True), ROBOT),
        lambda: lateral_motion_figure(made_trial(ROBOT, "slow", flagged=True), ROBOT),
        lambda: forward_path_figure(made_trial(ROBOT, "slow", flagged=True)),
        lambda: coefficients_figure(made_fit()),
        lambda: convergence_figure(made_fit()),
        lambda: flagged_samples_figure(made_trial(ROBOT, "slow", flagged=True).measured),
        lambda: planform_figure(ROBOT, tuple(ROBOT.markers)),
    ],
)
def test_every_figure_draws_within_its_frame(figure) -> None:  # type: ignore[no-untyped-def]
    drawn: Figure = figure()
    drawn.canvas.draw()
    box = drawn.get_tightbbox()
    width, height = drawn.get_size_inches()

    assert box.x0 > -0.02
    assert box.y0 > -0.02
    assert box.x1 < width + 0.02
    assert box.y1 < height + 0.02


def test_midlines_of_a_beat_are_those_of_the_wave() -> None:
    trial = made_trial(ROBOT, "medium")
    measured, twin = beat_midlines(trial, ROBOT)
    shape = trial.measured.head.shape_m

    assert measured.shape == (16, len(MARKERS), 2)
    np.testing.assert_allclose(measured[..., 0], np.broadcast_to(shape[0, :, 0], (16, len(MARKERS))), atol=1e-9)
    assert np.ptp(measured[:, -1, 1]) == pytest.approx(np.ptp(shape[:, -1, 1]), rel=0.05)
    assert np.ptp(twin[:, -1, 1]) == pytest.approx(1.15 * np.ptp(measured[:, -1, 1]), rel=0.03)


def test_flagged_samples_do_not_enter_the_midlines() -> None:
    trial = made_trial(ROBOT, "medium")
    wrong = trial.measured.head.shape_m.copy()
    wrong[60:70, 4] += 1.0
    weight = trial.measured.weight.copy()
    weight[60:70, 4] = 0.0
    measured = replace(trial.measured, head=replace(trial.measured.head, shape_m=wrong), weight=weight)

    clean, _ = beat_midlines(trial, ROBOT)
    spoilt, _ = beat_midlines(replace(trial, measured=measured), ROBOT)

    np.testing.assert_allclose(spoilt, clean, atol=0.01)


def test_markers_off_the_middle_plane_are_no_part_of_the_midline() -> None:
    trial = made_trial(ROBOT, "medium")
    markers = ("nose", "neck", "pectoral_left", *MARKERS[3:])
    measured = replace(trial.measured, markers=markers)

    midlines, _ = beat_midlines(replace(trial, measured=measured), ROBOT)

    assert midlines.shape == (16, len(MARKERS) - 1, 2)


def test_each_sample_left_out_has_a_reason_and_no_other_has() -> None:
    trial = made_trial(ROBOT, "slow", flagged=True).measured
    kinds = flagged_kinds(trial)

    assert ((kinds != "") == (trial.weight <= 0)).all()
    assert set(kinds[100:140, MARKERS.index("tail_3")]) == {"merged_markers"}
    assert set(kinds[20:25, MARKERS.index("neck")]) == {"jump"}
    assert set(kinds[20:25, MARKERS.index("tail_1")]) == {"head not trusted"}


def test_runs_are_the_unbroken_stretches() -> None:
    assert runs(np.array([1, 1, 0, 1, 0, 0, 1], bool)) == [(0, 1), (3, 3), (6, 6)]
    assert runs(np.zeros(3, bool)) == []


def test_a_coefficient_at_its_bound_is_told_apart() -> None:
    np.testing.assert_array_equal(coefficients_at_bound(made_fit()), [False, False, False, False, True])


def test_the_twin_curve_is_dashed_where_nothing_was_fitted() -> None:
    (axes,) = speed_sweep_figure(made_calibration()).axes
    curves = [line for line in axes.lines if to_hex(line.get_color()) == TWIN and len(line.get_xdata()) > 2]
    solid = [line for line in curves if line.get_linestyle() == "-"]

    assert len(curves) == 2
    assert [(min(line.get_xdata()), max(line.get_xdata())) for line in solid] == [(0.8, 1.3)]


def test_held_out_trials_have_a_marker_of_their_own() -> None:
    (axes,) = speed_sweep_figure(made_calibration()).axes
    marker = {line.get_xdata()[0]: line.get_marker() for line in axes.lines if len(line.get_xdata()) == 1}

    assert marker[0.5] != marker[0.8]
    assert marker[0.8] == marker[1.3]
