"""The section on each trial and the twin: shape through the beat, distance swum, lateral motion."""

import numpy as np

from fitting import CalibratedTrial
from reports.blocks import Plot, Plots, Section
from reports.context import ReportContext
from reports.figures.hero import representative
from reports.figures.trial import beat_midlines, forward_path_figure, lateral_motion_figure, tail_envelope_figure
from reports.numbers import MISSING, in_mm, shown
from swimmer import RobotSpec


def build(context: ReportContext) -> Section:
    """Build the section: envelopes of all trials; over time only the trial of the first screen."""
    robot, trials = context.calibration.robot, context.calibration.trials
    text = (
        "Midlines through the beat in the frame of the head, to scale, robot above twin; dotted in both: the robot’s "
        "envelope."
    )
    blocks = [Plots(tuple(_envelope(trial, robot) for trial in trials), text)]
    if (chosen := representative(trials)) is not None:
        blocks.append(Plots(_motion(chosen, robot)[1:]))  # the path alone shows no difference
    return Section("The body through the beat", "trials", tuple(blocks))


def trial_plots(trial: CalibratedTrial, robot: RobotSpec) -> dict[str, Plot]:
    """Draw envelope, path and lateral motion of one trial, by the figure's name."""
    return {plot.name: plot for plot in (_envelope(trial, robot), *_motion(trial, robot))}


def build_motions(context: ReportContext) -> Section:
    """Build a section with the motion of every trial over time: for notebooks, too much for a page."""
    plots = [plot for trial in context.calibration.trials for plot in _motion(trial, context.calibration.robot)]
    return Section("Trials over time", "motions", (Plots(tuple(plots)),))


def _label(trial: CalibratedTrial) -> str:
    measured = trial.measured
    role = "fitted" if measured.role == "fit" else "held out"
    return f"{measured.name}, {shown(measured.frequency.hz, 2)} Hz, {role}"


def _envelope(trial: CalibratedTrial, robot: RobotSpec) -> Plot:
    measured, simulated = beat_midlines(trial, robot)
    sweep = f"the fin sweeps {_sweep(measured)} mm, the twin’s {_sweep(simulated)} mm"
    return Plot(
        tail_envelope_figure(trial, robot),
        f"{trial.measured.name}-envelope",
        f"Midlines at sixteen phases of the beat, mean over all compared beats, to scale; {sweep}.",
        label=f"{_label(trial)}.",
    )


def _motion(trial: CalibratedTrial, robot: RobotSpec) -> tuple[Plot, Plot]:
    name = trial.measured.name
    path = Plot(
        forward_path_figure(trial),
        f"{name}-path",
        f"{_label(trial)}: distance swum along the head’s own axis. On grey ground nothing is compared.",
    )
    lateral = Plot(
        lateral_motion_figure(trial, robot),
        f"{name}-lateral",
        f"{_label(trial)}: lateral motion of the tail, from root (top) to fin. A growing lag is an error of frequency.",
    )
    return path, lateral


def _sweep(midlines_m: np.ndarray) -> str:
    """Compute how far the last marker sweeps from side to side, mm."""
    tip = midlines_m[:, -1, 1]
    return MISSING if np.isnan(tip).all() else in_mm(float(np.nanmax(tip) - np.nanmin(tip)), 0)
