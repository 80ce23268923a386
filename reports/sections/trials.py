"""Each trial and the twin: shape through the beat, distance swum, lateral motion, scores and flags."""

import numpy as np

from fitting import CalibratedTrial
from reports.blocks import Block, Plot, Plots, Prose, Section, Table, table_head
from reports.caveats import beats_compared, scored_seconds, track_flags, trial_caveats
from reports.context import ReportContext
from reports.figures.trial import beat_midlines, forward_path_figure, lateral_motion_figure, tail_envelope_figure
from reports.numbers import MISSING, counted, in_mm, percent, sentence, shown
from swimmer import RobotSpec

SCORES = table_head(
    "marker distance [mm] | over all samples [mm] | shape alone [mm] | samples used [%] | speed measured [mm/s] | "
    "twin [mm/s] | EBT [published] | EBT [large ampl.]"
)


def build(context: ReportContext) -> Section:
    """One part a trial, in the order of the session."""
    intro = (
        "Measured and simulated motion of each trial, in the head frame. Grey: frames that are not compared (the "
        "warm-up; in held-out trials also the first beats, which set frequency, phase and start). The bar on top marks "
        "the window of the marker distance."
    )
    trials = context.calibration.trials
    parts = tuple(_part(number, trial, context.calibration.robot) for number, trial in enumerate(trials, start=1))
    return Section("Trials", "trials", (Prose(intro),), parts=parts)


def _part(number: int, trial: CalibratedTrial, robot: RobotSpec) -> Section:
    measured = trial.measured
    role = "fit" if measured.role == "fit" else "held out"
    return Section(
        f"{measured.name} – {shown(measured.frequency.hz, 2)} Hz, {role}",
        f"trial-{number}",
        (_scores(trial), Plots(_plots(trial, robot)), _flags(trial)),
        trial_caveats(trial),
    )


def _scores(trial: CalibratedTrial) -> Table:
    measured, scores = trial.measured, trial.scores
    phase_deg = float((np.degrees(trial.phase_rad) + 180) % 360 - 180)  # between -180 and 180
    beat = measured.beat or measured.frequency
    command = "" if measured.commanded_hz is None else f", commanded {shown(measured.commanded_hz, 2)} Hz"
    row = (
        in_mm(scores.marker_error_m),
        in_mm(scores.marker_error_all_m),
        in_mm(scores.shape_error_m),
        percent(scores.used_fraction).removesuffix(" %"),
        in_mm(measured.speed),
        in_mm(trial.speed_twin),
        in_mm(trial.speed_ebt),
        in_mm(trial.speeds["large"]),
    )
    return Table(
        f"Tail beat {shown(beat.hz, 4)} ± {shown(beat.se_hz, 4)} Hz{command}; "
        f"the twin's crank {_turn(trial)} from a phase of {shown(phase_deg, 0)}°. "
        f"Scored over {shown(scored_seconds(measured))} s, speeds "
        f"over {counted(beats_compared(measured), 'whole beat')}.",
        SCORES,
        (row,),
    )


def _turn(trial: CalibratedTrial) -> str:
    motor = trial.measured.motor
    if motor is None or not motor.usable:
        return f"turns at {shown(trial.simulated_hz, 4)} Hz"
    return f"follows the motor's log ({shown(motor.measured_hz, 4)} turns/s)"


def _plots(trial: CalibratedTrial, robot: RobotSpec) -> tuple[Plot, ...]:
    name, (measured, simulated) = trial.measured.name, beat_midlines(trial, robot)
    envelope = Plot(
        tail_envelope_figure(trial, robot),
        f"{name}-envelope",
        "Midlines at sixteen phases of the beat, mean over all compared beats, to scale; the nose is at 0. "
        f"The dotted outline is the measured envelope in both. The last marker sweeps {_sweep(measured)} "
        f"mm, the twin's {_sweep(simulated)} mm.",
    )
    path = Plot(
        forward_path_figure(trial),
        f"{name}-path",
        "Distance swum along the head's own axis, 0 at the first compared frame. Slopes are speeds; the dashed line "
        "has the speed by elongated body theory as published.",
    )
    lateral = Plot(
        lateral_motion_figure(trial, robot),
        f"{name}-lateral",
        "Lateral motion of the tail markers relative to the head, from root (top) to fin, all to the scale "
        "on the right. A steady lag is an error of phase, a growing one an error of frequency.",
    )
    return envelope, path, lateral


def _sweep(midlines_m: np.ndarray) -> str:
    """Side to side of the last marker, mm."""
    tip = midlines_m[:, -1, 1]
    return MISSING if np.isnan(tip).all() else in_mm(float(np.nanmax(tip) - np.nanmin(tip)), 0)


def _flags(trial: CalibratedTrial) -> Block:
    flags = track_flags(trial.measured)
    if not flags:
        return Prose("No stretch of its tracks is flagged.")
    rows = []
    for flag in flags:
        first, last = flag.frames or (0, len(trial.measured.time_s) - 1)
        start, end = (trial.measured.time_s[min(frame, len(trial.measured.time_s) - 1)] for frame in (first, last))
        when = f"{shown(start, 2)} to {shown(end, 2)}"
        rows.append((flag.kind.replace("_", " "), f"{first} to {last}", when, sentence(flag.message)))
    columns = table_head("flag | frames [] | time [s] | what was seen")
    return Table(
        f"{'1 flagged stretch' if len(flags) == 1 else f'{len(flags)} flagged stretches'}, left out of the fit",
        columns,
        tuple(rows),
        folded=True,
    )
