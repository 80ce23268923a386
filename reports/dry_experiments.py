"""Sections on the experiments in air, with their figures: free decays and dry runs."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MultipleLocator

from fitting.crank_fit import CrankFit, CrankTrial
from fitting.dry_run import PUBLISHED_STRETCH
from fitting.free_decay import DecaySpectrum
from fitting.hinges import DecayFit, HingeEstimate
from fitting.structure import Structure
from reports.context import ReportContext
from reports.page import Plot, Plots, Prose, Section, Table, table_head
from reports.style import (
    EBT,
    FAINT,
    FULL_WIDTH_IN,
    HALF_WIDTH_IN,
    INK,
    MUTED,
    TWIN,
    Grid,
    Look,
    Margins,
    legend_above,
    legend_on_top,
    panel,
    panels,
    styled,
)
from reports.words import (
    MISSING,
    MM,
    counted,
    in_mm,
    listed,
    percent,
    sentence,
    shortened,
    shown,
    significant,
    with_error,
)

# Free decays
_LABEL_GAP = 0.074  # least distance between two names, as a share of the height
_CLOSE = 0.24  # room for the names before time 0, as a share of the time shown
_STEP_S = 0.1  # the time axis ends at a multiple of this, so that similar decays get the same axis
_FADED = 0.02  # a swing below this share of the first one cannot be seen
_SHOWN = 2.6  # the spectrum is drawn up to this many times the frequency, rounded to a whole Hz

PUBLISHED_HZ = 3.5  # "Simple Models, Real Swimming" (2026)
METHOD = f"Published peak of the spectrum, of a robot of 0.57 m: {PUBLISHED_HZ:g} Hz."
DECAY_COLUMNS = table_head(
    "free decay | peak [Hz] | first match [N m/rad] | stiffness [N m/rad] | damping [mN m s/rad] | "
    "distance [mm, rms] | explained [] | counts"
)
MILLI = 1000.0  # mN m s in one N m s

# Dry runs
_PULLS = 0.0005  # tendons that stretch by less pull with less than a newton or two
ABOVE_MM = (0.5, 1.0, 2.0, 4.0, 8.0, 16.0)  # heights of the contours above the lowest point
_SHADE = 0.11  # opacity of each level; levels overlap

NOT_USED = "The arm below is not used: the swim trials were fitted with the assumed one."
DRY_RUN_COLUMNS = table_head(
    "dry run | commanded [Hz] | speed [Hz, ± standard error] | off command [%] | phase [°] | distance [mm] | "
    "lowest alone [mm] | arm alone [mm]"
)


# Free decays.


@styled
def decay_curve_figure(fit: DecayFit) -> Figure:
    """Draw the measured samples as dots and the twin as lines, about the straight tail."""
    figure, axes = panel(HALF_WIDTH_IN, 2.9, Margins(top=0.5))
    for k in range(len(fit.markers)):
        axes.plot(fit.time_s, fit.measured_m[:, k] * MM, ".", color=INK, markersize=2.2, label="measured", zorder=2.1)
        axes.plot(fit.time_s, fit.simulated_m[:, k] * MM, color=TWIN, linewidth=1.1, label="twin")
    end_s = _end_s(fit.time_s, np.abs(fit.simulated_m).max(axis=1))
    axes.set_xlim(-_CLOSE * end_s, end_s)
    axes.set_xticks([tick for tick in axes.get_xticks() if 0.0 <= tick <= end_s])
    _name_curves(axes, fit)
    axes.set(xlabel="time after the release (s)", ylabel="lateral position (mm)")
    legend_above(axes, 2)
    return figure


def _end_s(time_s: np.ndarray, swing: np.ndarray) -> float:
    """Find the end of the time axis: when the swing (n,) has faded, or the end of the decay."""
    swinging = np.flatnonzero(swing > _FADED * swing[0])
    faded_s = float(time_s[min(int(swinging[-1]) + 1, len(time_s) - 1)])
    return min(_STEP_S * float(np.ceil(faded_s / _STEP_S)), float(time_s[-1]))


def _name_curves(axes: Axes, fit: DecayFit) -> None:
    start = fit.simulated_m[0] * MM
    low, high = axes.get_ylim()
    order, place = np.argsort(start), start.copy()
    for before, k in pairwise(order):
        place[k] = max(place[k], place[before] + _LABEL_GAP * (high - low))
    place -= (place - start).mean()
    for name, at in zip(fit.markers, place, strict=True):
        text = shortened(name, 12)
        axes.annotate(text, (0.0, at), (-4, 0), textcoords="offset points", ha="right", va="center", fontsize=7.0)


@styled
def decay_spectrum_figure(spectrum: DecaySpectrum) -> Figure:
    """Draw amplitude over frequency for every tail marker, their rms, and its peak."""
    figure, axes = panel(HALF_WIDTH_IN, 2.9, Margins(top=0.5))
    end_hz = min(max(round(_SHOWN * (spectrum.peak_hz or 0.0)), 8), spectrum.bins_hz[-1])
    shown = spectrum.bins_hz <= end_hz
    bins_hz = spectrum.bins_hz[shown]
    axes.plot(bins_hz, spectrum.amplitude_m[shown] * MM, color=MUTED, linewidth=0.6, alpha=0.7, label="markers")
    axes.plot(bins_hz, spectrum.rms_m[shown] * MM, color=INK, linewidth=1.6, label="rms of markers")
    if spectrum.peak_hz is not None:
        height = float(np.interp(spectrum.peak_hz, spectrum.bins_hz, spectrum.rms_m)) * MM
        label = f"peak at {spectrum.peak_hz:.2f} Hz"
        axes.plot(spectrum.peak_hz, height, "o", color=INK, markerfacecolor=FAINT, markersize=5, label=label)
    axes.set_xlim(0.0, end_hz)
    axes.set_ylim(bottom=0.0)
    axes.set(xlabel="frequency (Hz)", ylabel="lateral amplitude (mm)")
    legend_above(axes, 2)
    return figure


def build_free_decay(context: ReportContext) -> Section | None:
    """Build the section; None where there is no free decay."""
    structure = context.calibration.structure
    return free_decay_section(structure) if structure.decays else None


def free_decay_section(structure: Structure) -> Section:
    """Build the section from a structure: the common fit, a table of the decays, their spectra and curves."""
    plots = [plot for number, fit in enumerate(structure.decays, start=1) for plot in _plots(fit, number)]
    caveats = [sentence(f"{fit.name}: {flag.message}") for fit in structure.decays for flag in fit.flags]
    caveats += [sentence(flag.message) for flag in (structure.hinges.flags if structure.hinges else ())]
    curves = Plots(tuple(plots), "Spectrum and curve of each decay: markers (dots), twin (lines).", folded=True)
    blocks = (Prose(f"{_result(structure.hinges)} {METHOD}"), _decay_table(structure), curves)
    return Section("Free decays", "free-decay", blocks, tuple(caveats))


def _result(hinges: HingeEstimate | None) -> str:
    if hinges is None:
        return "No free decay can be believed: stiffness and damping of the hinges are assumed."
    stiffness = with_error(hinges.stiffness_n_m, hinges.stiffness_se_n_m)
    damping = with_error(MILLI * hinges.damping_n_m_s, MILLI * hinges.damping_se_n_m_s)
    several = f"The {counted(hinges.decays, 'free decay')} together give"
    source = "The free decay gives" if hinges.decays == 1 else several
    return (
        f"{source} a stiffness of {stiffness} N m/rad and a damping of {damping} mN m s/rad for every hinge (± "
        "standard error)."
    )


def _decay_table(structure: Structure) -> Table:
    caption = (
        "Each free decay with standard errors: the peak of its spectrum, the stiffness whose twin peaks there too, and "
        "the hinges by the whole curve."
    )
    used = {name for source in structure.sources if source.quantity == "hinge_stiffness" for name in source.trials}
    return Table(
        caption, DECAY_COLUMNS, tuple(_decay_row(fit, fit.name in used) for fit in structure.decays), folded=True
    )


def _decay_row(fit: DecayFit, used: bool) -> tuple[str, ...]:
    return (
        fit.name,
        shown(fit.spectrum.peak_hz, 2),
        significant(fit.matched_stiffness_n_m),
        with_error(fit.stiffness_n_m, fit.stiffness_se_n_m),
        with_error(MILLI * fit.damping_n_m_s, MILLI * fit.damping_se_n_m_s),
        in_mm(fit.rms_m, 2),
        percent(fit.explained),
        "yes" if used else "no",
    )


def _plots(fit: DecayFit, number: int) -> tuple[Plot, Plot]:
    spectrum, curve = f"decay-spectrum-{number}", f"decay-{number}"
    return (
        Plot(
            decay_spectrum_figure(fit.spectrum),
            spectrum,
            f"{fit.name}: amplitude of the tail markers under the falling half of a Hann window, and the peak.",
            label=f"{fit.name}: spectrum.",
        ),
        Plot(
            decay_curve_figure(fit),
            curve,
            f"{fit.name}: tail markers after the release (dots) and the twin with the fitted hinges (lines), about the "
            "straight tail.",
            label=f"{fit.name}: curve.",
        ),
    )


# Dry runs.


@styled
def crank_surface_figure(fit: CrankFit) -> Figure:
    """Draw two panels a run: over arm and speed with the best phase, over arm and phase with the best speed."""
    grid = Grid(2, 1.9, gap_in=(0.7, 0.42))
    figure, drawn = panels(2 * len(fit.trials), grid, FULL_WIDTH_IN, Margins(left=0.66, top=0.56))
    for trial, left, right in zip(fit.trials, drawn[::2], drawn[1::2], strict=True):
        surface, best = trial.surface, trial.published
        _draw(left, surface.arm_m, surface.hz, surface.over_phase_m)
        _mark(left, fit, (best.arm_m, best.hz), trial.speed_hz)
        left.set_ylabel("speed (turns/s)")
        phase, over = _centre(trial)
        _draw(right, surface.arm_m, phase, over)
        _mark(
            right, fit, (best.arm_m, _shift_into_axis(best.phase_rad, phase)), _shift_into_axis(trial.phase_rad, phase)
        )
        right.set_ylabel("phase (°)")
        right.yaxis.set_major_locator(MultipleLocator(90.0))
        lowest = f"{MM * best.distance_m:.1f} mm at its lowest"
        left.set_title(f"{shortened(trial.name)}: {lowest}", loc="left", pad=3)
    for axes in drawn[-2:]:
        axes.set_xlabel("crank arm (mm)")
    legend_on_top(figure, 5)
    return figure


def _draw(axes: Axes, arm_m: np.ndarray, other: np.ndarray, distance_m: np.ndarray) -> None:
    """Draw contours of a distance (a, o), darker where it is lower."""
    distance = distance_m.T * MM
    lowest = float(distance.min())
    names = {lowest + above: f"+{above:g}" for above in ABOVE_MM if lowest + above < distance.max()}
    levels = list(names)
    for level in levels:
        axes.contourf(arm_m * MM, other, distance, [0.0, level], colors=[TWIN], alpha=_SHADE)
    lines = axes.contour(arm_m * MM, other, distance, levels, colors=[MUTED], linewidths=0.5)
    axes.clabel(lines, fmt=names, fontsize=6.0, colors=[INK])
    axes.set_xlim(arm_m[0] * MM, arm_m[-1] * MM)
    axes.grid(visible=False)


def _mark(axes: Axes, fit: CrankFit, published: tuple[float, float], joint: float) -> None:
    """Mark the run's own lowest point, the joint fit with its 95 % interval, and where the tail snaps."""
    ring: Look = {"color": EBT, "markersize": 5.0, "markerfacecolor": "none", "label": "lowest of this run (published)"}
    axes.plot(published[0] * MM, published[1], "D", **ring)
    axes.plot(fit.arm_m * MM, joint, "o", color=INK, markersize=4.0, label="joint fit, 95 %")
    axes.errorbar(fit.arm_m * MM, joint, xerr=1.96 * fit.arm_se_m * MM, fmt="none", ecolor=INK, elinewidth=1.2)
    for end in fit.smooth_m:
        if axes.get_xlim()[0] + 1e-6 < end * MM < axes.get_xlim()[1] - 1e-6:
            axes.axvline(end * MM, color=INK, linewidth=0.8, linestyle=(0, (1, 2)), label="the tail snaps over")


def _centre(trial: CrankTrial) -> tuple[np.ndarray, np.ndarray]:
    """Centre the phases on the fitted one.

    Returns:
        (p + 1,) phases in degrees, the fitted one in the middle, and (a, p + 1) the lowest distance over all speeds, m.
    """
    count = len(trial.surface.phase_rad)
    first = int(np.floor(trial.phase_rad / (2 * np.pi) * count)) - count // 2
    steps = first + np.arange(count + 1)
    return 360.0 * steps / count, trial.surface.over_speed_m[:, steps % count]


def _shift_into_axis(phase_rad: float, phase_deg: np.ndarray) -> float:
    """Shift a phase by whole turns into the range of the axis, in degrees."""
    return float((np.degrees(phase_rad) - phase_deg[0]) % 360.0 + phase_deg[0])


def build_dry_runs(context: ReportContext) -> Section | None:
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
            _dry_run_table(fit),
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


def _dry_run_table(fit: CrankFit) -> Table:
    caption = (
        "Each dry run: speed, crank angle in the first frame, marker distance of the twin with the joint arm, and the "
        "lowest of this run alone."
    )
    logged = any(trial.measured.motor for trial in fit.trials)
    return Table(caption, DRY_RUN_COLUMNS, tuple(_dry_run_row(trial, logged) for trial in fit.trials), folded=True)


def _dry_run_row(trial: CrankTrial, logged: bool) -> tuple[str, ...]:
    """Make the row of a run; where runs are `logged`, the section on the motor tells more of the command."""
    commanded = trial.measured.commanded_hz
    return (
        trial.name,
        shown(commanded, 3),
        f"{shown(trial.speed_hz, 4)} ± {shown(trial.speed_se_hz, 4)}",
        MISSING if logged or not commanded else shown(100 * (trial.speed_hz / commanded - 1), 1, signed=True),
        f"{shown(float(np.degrees(trial.phase_rad)), 1)} ± {shown(float(np.degrees(trial.phase_se_rad)), 1)}",
        in_mm(trial.marker_error_m),
        in_mm(trial.published.distance_m),
        in_mm(trial.published.arm_m, 2),
    )


def _tendons(fit: CrankFit) -> str:
    stretch = max(trial.tendons.stretch for trial in fit.trials)
    slack = max(trial.tendons.slack_share for trial in fit.trials)
    shortest = max(trial.tendons.shortening for trial in fit.trials)
    pulls = "" if stretch > _PULLS else " They never pull: springs that push move the tail, as no real tendon can."
    return (
        f"The twin’s tendons stretch by up to {100 * stretch:.1f} % (published: about "
        f"{100 * PUBLISHED_STRETCH:.0f} %) and shorten by up to {100 * shortest:.1f} %; for {percent(slack)} of the "
        f"turn a string would hang slack where the twin’s springs push.{pulls}"
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
