"""How fast the crank turned through each trial, beside what it was told."""

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from reports.logged_trial import LoggedTrial
from reports.numbers import shortened, shown
from reports.style import EBT, FULL_WIDTH_IN, INK, MUTED, SHADE, Grid, Margins, legend_on_top, panels, styled

HEIGHT_IN = 1.25


@styled
def motor_speed_figure(trials: Sequence[LoggedTrial]) -> Figure:
    """A panel a trial, all to one scale: the log's speed and the command over time."""
    columns = min(len(trials), 2)
    figure, drawn = panels(
        len(trials), Grid(columns, HEIGHT_IN, gap_in=(0.3, 0.5)), FULL_WIDTH_IN, Margins(top=0.5, right=0.14)
    )
    limits = _limits(trials)
    for number, (trial, axes) in enumerate(zip(trials, drawn, strict=True)):
        _draw(axes, trial)
        axes.set_ylim(*limits)
        axes.set_title(shortened(trial.name, 24), loc="left", fontweight="bold", pad=4)
        axes.set_title(_result(trial), loc="right", pad=4)
        if number % columns == 0:
            axes.set_ylabel("crank (turns/s)")
        else:
            axes.tick_params(axis="y", labelleft=False)
        if number >= len(trials) - columns:
            axes.set_xlabel("time (s)")
    legend_on_top(figure, _handles(trials), 4)
    return figure


def _limits(trials: Sequence[LoggedTrial]) -> tuple[float, float]:
    """Of the axis of speeds that all panels share, with room for the bar on top."""
    speeds = np.concatenate([np.concatenate([trial.speed[1], _told(trial)[1]]) for trial in trials])
    known = speeds[np.isfinite(speeds)]
    slowest, fastest = float(known.min(initial=0.0)), float(known.max(initial=0.1))
    room = 0.12 * (fastest - slowest)
    return slowest - room, fastest + 1.6 * room


def _draw(axes: Axes, trial: LoggedTrial) -> None:
    time_s, speed = trial.speed
    time_s = time_s - trial.zero_s
    for start, end in np.array(trial.codes).reshape(-1, 2) - trial.zero_s:
        axes.axvspan(start, end, facecolor=SHADE, linewidth=0)
    told_s, told = _told(trial)
    told_s = told_s - trial.zero_s
    axes.plot(told_s, told, color=EBT, linewidth=2.4, drawstyle="steps-post", solid_joinstyle="miter", alpha=0.8)
    axes.plot(time_s, speed, color=INK, linewidth=0.9)
    start, end = np.array(trial.motor.drive_s) - trial.zero_s
    axes.plot([start, end], [0.985, 0.985], color=MUTED, linewidth=2.5, transform=axes.get_xaxis_transform())
    axes.set_xlim(time_s[0], time_s[-1])


def _told(trial: LoggedTrial) -> tuple[np.ndarray, np.ndarray]:
    """The command, its last speed held to the end of the log; where none was kept, one over the steady stretch."""
    command = trial.command
    if command is None:
        return np.array(trial.motor.drive_s), np.full(2, trial.motor.commanded_hz)
    end_s = max(trial.speed[0][-1], command[0][-1])
    return np.append(command[0], end_s), np.append(command[1], command[1][-1])


def _result(trial: LoggedTrial) -> str:
    hz = trial.motor.commanded_hz
    return f"{shown(trial.motor.measured_hz, 3)}{f' of {shown(hz, 3)}' if hz > 0 else ''} turns/s"


def _handles(trials: Sequence[LoggedTrial]) -> list[Line2D | Patch]:
    handles: list[Line2D | Patch] = [
        Line2D([], [], color=INK, linewidth=0.9, label="measured by the motor"),
        Line2D([], [], color=EBT, linewidth=2.4, alpha=0.8, label="commanded"),
        Line2D([], [], color=MUTED, linewidth=2.5, label="steady stretch"),
    ]
    return handles + ([Patch(facecolor=SHADE, label="code")] if any(trial.codes for trial in trials) else [])
