"""The crank's error surface and section show arm, runs and flags."""

from dataclasses import replace

import numpy as np
import pytest

from fitting.crank_fit import CrankFit, CrankTrial
from fitting.crank_surface import Cell, ErrorSurface
from fitting.dry_run import DryTrial, TendonUse
from fitting.frequency import SwimFrequency
from reports.dry_experiments import crank_surface_figure, dry_run_section
from reports.page import Prose, Table
from swimcal.flags import Flag

SLACK = Flag("tendon_pushes", message="for 83 % of the turn a tendon is shorter than at rest")


def made_run(name: str, hz: float, phase_rad: float, **changes: object) -> CrankTrial:
    """A valley at 39 mm and this speed and phase."""
    arm, speeds, phases = np.linspace(0.03, 0.049, 20), np.linspace(0.85, 1.15, 21) * hz, np.arange(24) * np.pi / 12
    away = np.angle(np.exp(1j * (phases - phase_rad)))
    rise = 2000 * (arm - 0.039)[:, None, None] ** 2 * 1e-1 + 0.2 * ((speeds / hz - 1)[:, None]) ** 2 + 0.01 * away**2
    surface = ErrorSurface(arm, speeds, phases, 0.005 + np.sqrt(rise) * 0.1)
    n = 10
    measured = DryTrial(
        name=name,
        commanded_hz=1.02 * hz,
        markers=("nose", "neck", "caudal_fin"),
        time_s=np.arange(n) / 60.0,
        even_s=np.arange(n) / 60.0,
        place_m=np.zeros((n, 3), complex),
        head_m=np.zeros((n, 3), complex),
        weight=np.ones((n, 3)),
        scored=np.ones(n, bool),
        frequency=SwimFrequency(hz, 0.001, 0.0, 0.1, 1.0, 3.0, None),
        tail=(2,),
        flags=(),
    )
    run = CrankTrial(
        measured=measured,
        speed_hz=hz,
        speed_se_hz=2e-4,
        phase_rad=phase_rad,
        phase_se_rad=0.003,
        marker_error_m=0.0052,
        scale=0.99,
        motion_error_m=0.0005,
        published=Cell(0.0391, hz, phase_rad, 0.005),
        surface=surface,
        tendons=TendonUse(0.0004, 0.018, 0.83),
        flags=(SLACK,),
    )
    return replace(run, **changes)  # type: ignore[arg-type]


def made_crank(*runs: CrankTrial, smooth_m: tuple[float, float] = (0.03, 0.0415)) -> CrankFit:
    both = runs or (made_run("dry_slow", 0.6, 0.1), made_run("dry_fast", 1.19, 4.0))
    return CrankFit(0.0384, 6e-5, smooth_m, both, (Flag("at_bound", message="the arm is at the end of its range"),))


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
