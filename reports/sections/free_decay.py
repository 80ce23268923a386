"""The section on the free decays: stiffness and damping of the hinges, how the tail rings, and the twin's decay."""

from fitting import Structure
from fitting.free_decay import DecayFit, HingeEstimate
from reports.blocks import Plot, Plots, Prose, Section, Table, table_head
from reports.context import ReportContext
from reports.figures.decay import decay_curve_figure, decay_spectrum_figure
from reports.numbers import counted, in_mm, percent, sentence, shown, significant, with_error

PUBLISHED_HZ = 3.5  # "Simple Models, Real Swimming" (2026)
METHOD = f"Published peak of the spectrum for this kind of robot: {PUBLISHED_HZ:g} Hz."
COLUMNS = table_head(
    "free decay | peak [Hz] | first match [N m/rad] | stiffness [N m/rad] | damping [mN m s/rad] | "
    "distance [mm, rms] | explained [] | counts"
)
MILLI = 1000.0


def build(context: ReportContext) -> Section | None:
    """Build the section; None where there is no free decay."""
    structure = context.calibration.structure
    return free_decay_section(structure) if structure.decays else None


def free_decay_section(structure: Structure) -> Section:
    """Build the section from a structure: the common fit, a table of the decays, their spectra and curves."""
    plots = [plot for number, fit in enumerate(structure.decays, start=1) for plot in _plots(fit, number)]
    caveats = [sentence(f"{fit.name}: {flag.message}") for fit in structure.decays for flag in fit.flags]
    caveats += [sentence(flag.message) for flag in (structure.hinges.flags if structure.hinges else ())]
    curves = Plots(tuple(plots), "Spectrum and curve of each decay: markers (dots), twin (lines).", folded=True)
    blocks = (Prose(f"{_result(structure.hinges)} {METHOD}"), _table(structure), curves)
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


def _table(structure: Structure) -> Table:
    caption = (
        "Each free decay with standard errors: the peak of its spectrum, the stiffness whose twin peaks there too, and "
        "the hinges by the whole curve."
    )
    used = {name for source in structure.sources if source.quantity == "hinge_stiffness" for name in source.trials}
    return Table(caption, COLUMNS, tuple(_row(fit, fit.name in used) for fit in structure.decays), folded=True)


def _row(fit: DecayFit, used: bool) -> tuple[str, ...]:
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
