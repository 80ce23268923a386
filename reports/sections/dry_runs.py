"""The section on the dry runs: the crank arm, as published and from all runs together, and the values of each run."""

from dataclasses import replace
from typing import TypeVar

import numpy as np

from fitting.dry_run import PUBLISHED_STRETCH, CrankFit, CrankTrial
from reports.blocks import Plot, Plots, Prose, Section, Table, table_head
from reports.context import ReportContext
from reports.figures.crank_surface import crank_surface_figure
from reports.numbers import MISSING, in_mm, listed, percent, sentence, shown

T = TypeVar("T")

NOT_USED = "The arm below is not used: the swim trials were fitted with the assumed one."
COLUMNS = table_head(
    "dry run | commanded [Hz] | speed [Hz, ± standard error] | off command [%] | phase [°] | distance [mm] | "
    "lowest alone [mm] | arm alone [mm]"
)
OFF_COMMAND = 3


def build(context: ReportContext) -> Section | None:
    """Build the section; None where there is no dry run."""
    structure = context.calibration.structure
    if structure.crank is None:
        return None
    section = dry_run_section(structure.crank)
    assumed = any(source.quantity == "crank_arm" and source.assumed for source in structure.sources)
    return replace(section, caveats=(NOT_USED, *section.caveats)) if assumed else section


def dry_run_section(fit: CrankFit) -> Section:
    """Build the section from a fit: the arm, a table of the runs, the error surface and the tendons."""
    surface = Plot(
        crank_surface_figure(fit),
        "crank-surface",
        "Marker distance of each dry run from the twin (mm above the lowest point), over arm and speed (left) or phase "
        "(right). A long, flat valley is an arm that the run alone hardly determines.",
    )
    surfaces = Plots((surface,), "The error surface of each run.", folded=True)
    return Section(
        "Dry runs",
        "dry-runs",
        (
            Prose(_arm(fit)),
            _table(fit),
            Prose(_tendons(fit)),
            surfaces,
        ),
        _caveats(fit),
    )


def _arm(fit: CrankFit) -> str:
    whole = {1: "The dry run gives", 2: "Both dry runs together give"}
    together = whole.get(len(fit.trials), f"All {len(fit.trials)} dry runs together give")
    alone = listed([f"{in_mm(arm, 2)} mm" for arm in fit.arm_per_trial_m])
    mean = "which" if len(fit.trials) == 1 else f"{alone}; their mean, {in_mm(fit.arm_published_m, 2)} mm,"
    each = f"{alone}, " if len(fit.trials) == 1 else ""
    return (
        f"{together} a crank arm of {in_mm(fit.arm_m, 2)} ± {in_mm(fit.arm_se_m, 2)} mm (standard error); the lowest "
        f"published distance of each run alone gives {each}{mean} is the published estimate, which takes nose "
        "and neck as they were marked."
    )


def _table(fit: CrankFit) -> Table:
    caption = (
        "Each dry run: speed, crank angle in the first frame, marker distance of the twin with the joint arm, and the "
        "lowest of this run alone."
    )
    rows = tuple(map(_row, fit.trials))
    if not any(trial.measured.motor for trial in fit.trials):
        return Table(caption, COLUMNS, rows, folded=True)
    return Table(caption, _without_command(COLUMNS), tuple(map(_without_command, rows)), folded=True)


def _without_command(cells: tuple[T, ...]) -> tuple[T, ...]:
    """Drop the cells about the command: with a motor log, the section on the motor tells more of it."""
    return cells[:OFF_COMMAND] + cells[OFF_COMMAND + 1 :]


def _row(trial: CrankTrial) -> tuple[str, ...]:
    commanded = trial.measured.commanded_hz
    return (
        trial.name,
        shown(commanded, 3),
        f"{shown(trial.speed_hz, 4)} ± {shown(trial.speed_se_hz, 4)}",
        MISSING if not commanded else shown(100 * (trial.speed_hz / commanded - 1), 1, signed=True),
        f"{shown(float(np.degrees(trial.phase_rad)), 1)} ± {shown(float(np.degrees(trial.phase_se_rad)), 1)}",
        in_mm(trial.marker_error_m),
        in_mm(trial.published.distance_m),
        in_mm(trial.published.arm_m, 2),
    )


def _tendons(fit: CrankFit) -> str:
    stretch = max(trial.tendons.stretch for trial in fit.trials)
    slack = max(trial.tendons.slack_share for trial in fit.trials)
    shortest = max(trial.tendons.shortening for trial in fit.trials)
    return (
        f"The twin’s tendons stretch by up to {100 * stretch:.1f} % (published: about "
        f"{100 * PUBLISHED_STRETCH:.0f} %) and shorten by up to {100 * shortest:.1f} %; for {percent(slack)} of the "
        "turn a string would hang slack where the twin’s springs push."
    )


def _caveats(fit: CrankFit) -> tuple[str, ...]:
    """List the flags of runs, each shared one once; those of the arm are on the first screen."""
    printed: set[str] = set()
    texts: list[str] = []
    others = " and the other run" if len(fit.trials) == 2 else " and all others"
    for trial in fit.trials:
        for flag in trial.flags:
            shared = len(fit.trials) > 1 and all(flag.kind in {f.kind for f in t.flags} for t in fit.trials)
            if shared and flag.kind in printed:
                continue
            printed.add(flag.kind)
            texts.append(sentence(f"{trial.name}{others if shared else ''}: {flag.message}"))
    return tuple(texts)
