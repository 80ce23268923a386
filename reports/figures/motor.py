"""The figures of the motor: its speed over time and through a turn."""

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from reports.colours import EBT, INK, MUTED, SHADE
from reports.logged_trial import BINS, LoggedTrial
from reports.numbers import shortened, shown
from reports.style import (
    FULL_WIDTH_IN,
    HALF_WIDTH_IN,
    Grid,
    Look,
    Margins,
    legend_on_top,
    name_panels,
    panels,
    small_multiples,
    styled,
)

_MOST_TURNS = 40  # number of turns drawn of each trial
_TALL_IN = 2.2  # height of all panels together where there are one or two rows
_ROW_IN = 1.4  # height of each row where there are more
_LEAST_REACH = 1.0  # every panel reaches at least this far from the mean speed, per cent


@styled
def motor_speed_figure(trials: Sequence[LoggedTrial]) -> Figure:
    """Draw the log's speed and the command over time, a panel a trial, all to one scale."""
    columns, margins = min(len(trials), 2), Margins(top=0.5, right=0.14)
    figure, drawn = panels(len(trials), Grid(columns, 1.25, gap_in=(0.3, 0.5)), FULL_WIDTH_IN, margins)
    limits = _limits(trials)
    name_panels(drawn, [shortened(trial.name, 24) for trial in trials], columns, "time (s)", "crank (turns/s)")
    for trial, axes in zip(trials, drawn, strict=True):
        _draw_speed(axes, trial)
        axes.set_ylim(*limits)
        axes.tick_params(labelbottom=True)
        hz = trial.motor.commanded_hz
        result = f"{shown(trial.motor.measured_hz, 3)}{f' of {shown(hz, 3)}' if hz > 0 else ''} turns/s"
        axes.set_title(result, loc="right", pad=3)
    legend_on_top(figure, 4)
    return figure


def _limits(trials: Sequence[LoggedTrial]) -> tuple[float, float]:
    """Choose the range of the axis of speeds that all panels share, with room for the bar on top."""
    speeds = np.concatenate([np.concatenate([trial.speed[1], _extend_command(trial)[1]]) for trial in trials])
    known = speeds[np.isfinite(speeds)]
    slowest, fastest = float(known.min(initial=0.0)), float(known.max(initial=0.1))
    room = 0.12 * (fastest - slowest)
    return slowest - room, fastest + 1.6 * room


def _draw_speed(axes: Axes, trial: LoggedTrial) -> None:
    time_s, speed = trial.speed
    commanded_s, commanded = _extend_command(trial)
    stepped: Look = {"drawstyle": "steps-post", "solid_joinstyle": "miter", "linewidth": 2.4, "alpha": 0.8}
    axes.plot(time_s - trial.zero_s, speed, color=INK, linewidth=0.9, label="measured by the motor", zorder=2.1)
    axes.plot(commanded_s - trial.zero_s, commanded, color=EBT, label="commanded", **stepped)
    drive_s, on_top = np.array(trial.motor.drive_s) - trial.zero_s, axes.get_xaxis_transform()
    axes.plot(drive_s, [0.985, 0.985], color=MUTED, linewidth=2.5, transform=on_top, label="steady stretch")
    for start, end in np.array(trial.codes).reshape(-1, 2) - trial.zero_s:
        axes.axvspan(start, end, facecolor=SHADE, linewidth=0, label="code")
    axes.set_xlim(time_s[0] - trial.zero_s, time_s[-1] - trial.zero_s)


def _extend_command(trial: LoggedTrial) -> tuple[np.ndarray, np.ndarray]:
    """Return the command, its last speed held to the end of the log.

    Without one, the mean command of the steady stretch.
    """
    command = trial.command
    if command is None:
        return np.array(trial.motor.drive_s), np.full(2, trial.motor.commanded_hz)
    end_s = max(trial.speed[0][-1], command[0][-1])
    return np.append(command[0], end_s), np.append(command[1], command[1][-1])


@styled
def motor_turn_figure(trials: Sequence[LoggedTrial]) -> Figure:
    """Draw the deviation from the mean speed over the shaft's angle, every turn and their mean, a panel a trial."""
    width, columns = _turn_layout(len(trials))
    rows, gap = -(-len(trials) // columns), 0.42
    height = _ROW_IN if rows > 2 else (_TALL_IN - gap * (rows - 1)) / rows
    figure, drawn = panels(len(trials), Grid(columns, height, gap_in=(0.28, gap)), width, Margins(top=0.5, right=0.16))
    turns = [100 * (trial.turns - 1) for trial in trials]
    reach = 1.1 * max([_LEAST_REACH, *(float(np.abs(percent).max()) for percent in turns if len(percent))])
    for percent, axes in zip(turns, drawn, strict=True):
        _draw_turns(axes, percent)
        axes.set_ylim(-reach, reach)
    names = [shortened(trial.name) for trial in trials]
    name_panels(drawn, names, columns, "angle of the shaft", "off its mean (%)")
    legend_on_top(figure, 2)
    return figure


def _turn_layout(count: int) -> tuple[float, int]:
    """Choose width and columns: those of all small multiples, but one or two panels fill the width, and four do not."""
    if count < 3:
        return FULL_WIDTH_IN, max(count, 1)
    return (HALF_WIDTH_IN, 2) if count == 4 else small_multiples(count)


def _draw_turns(axes: Axes, percent: np.ndarray) -> None:
    """Draw turns (t, BINS) as thin lines, closed to a whole turn, and their mean."""
    angle_deg = 360 * np.arange(BINS + 1) / BINS
    closed = np.concatenate([percent, percent[:, :1]], axis=1)
    axes.axhline(0.0, color=MUTED, linewidth=0.7)
    for turn in closed[-_MOST_TURNS:]:
        axes.plot(angle_deg, turn, color=MUTED, linewidth=0.5, alpha=0.5, label="a turn")
    if len(closed):
        axes.plot(angle_deg, closed.mean(axis=0), color=INK, linewidth=1.6, label="mean of the turns")
    axes.set_xlim(0, 360)
    axes.set_xticks([0, 180, 360], ["0°", "180°", "360°"])
