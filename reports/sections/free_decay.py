"""The free decays: stiffness and damping of the hinges, how the tail rings, and the twin's decay beside it."""

from collections.abc import Sequence

from fitting.free_decay import DecayFit, combine_decays
from reports.blocks import Column, Plot, Plots, Prose, Section, Table
from reports.figures.decay_curve import decay_curve_figure
from reports.figures.decay_spectrum import decay_spectrum_figure
from reports.numbers import in_mm, percent, sentence, shown, significant
from reports.svg import inline_svg

TITLE, ANCHOR = "Free decay: hinge stiffness", "free-decay"
PUBLISHED_HZ = 3.5  # "Simple Models, Real Swimming" (2026)
COLUMNS = (
    Column("free decay", numeric=False),
    Column("rings at", "Hz, ± standard error"),
    Column("spectrum’s peak", "Hz"),
    Column("undamped", "Hz"),
    Column("damping ratio"),
    Column("stiffness", "N m/rad, ± standard error"),
    Column("damping", "mN m s/rad, ± standard error"),
    Column("from frequency alone", "N m/rad"),
    Column("distance", "mm, rms"),
    Column("explained"),
)
MILLI = 1000.0


def free_decay_section(fits: Sequence[DecayFit]) -> Section:
    """What all decays say together, a table of them, and for each its spectrum and its curve beside the twin's."""
    plots = [plot for number, fit in enumerate(fits, start=1) for plot in _plots(fit, number)]
    return Section(TITLE, ANCHOR, (Prose(_text(fits)), _table(fits), Plots(tuple(plots))), _caveats(fits))


def _text(fits: Sequence[DecayFit]) -> str:
    hinges = combine_decays(fits)
    stiffness = _with_error(hinges.stiffness_n_m, hinges.stiffness_se_n_m)
    damping = _with_error(MILLI * hinges.damping_n_m_s, MILLI * hinges.damping_se_n_m_s)
    source = "The free decay gives" if len(fits) == 1 else f"{len(fits)} free decays together give"
    return (
        f"{source} a stiffness of {stiffness} N m/rad and a damping of {damping} mN m s/rad for every hinge (± "
        "standard error): the head is clamped in air, the tendons are off, the bent tail is let go, and the twin’s "
        "hinges are turned until it decays alike, first in frequency and decay, then over the whole curve. The peak of "
        "a spectrum, the frequency of the zero crossings and that of the same tail without damping are three numbers, "
        f"farther apart the stronger the damping; published for this kind of robot: {PUBLISHED_HZ:g} Hz."
    )


def _table(fits: Sequence[DecayFit]) -> Table:
    caption = (
        "Each free decay, from the release to rest. Distance and explained share compare the lateral motion of all "
        "tail markers with the twin’s."
    )
    return Table(caption, COLUMNS, tuple(map(_row, fits)))


def _row(fit: DecayFit) -> tuple[str, ...]:
    spectrum = fit.spectrum
    return (
        fit.name,
        _with_error(spectrum.frequency_hz, spectrum.frequency_se_hz),
        shown(spectrum.peak_hz, 2),
        shown(spectrum.natural_hz, 2),
        shown(spectrum.damping_ratio, 3),
        _with_error(fit.stiffness_n_m, fit.stiffness_se_n_m),
        _with_error(MILLI * fit.damping_n_m_s, MILLI * fit.damping_se_n_m_s),
        significant(fit.matched_stiffness_n_m),
        in_mm(fit.rms_m, 2),
        percent(fit.explained),
    )


def _with_error(value: float, se: float) -> str:
    """`0.650 ± 0.004`: as many decimals for both as the error needs."""
    decimals = next((d for d in range(1, 6) if se * 10**d >= 0.95), 6)
    return f"{shown(value, decimals)} ± {shown(se, decimals)}"


def _plots(fit: DecayFit, number: int) -> tuple[Plot, Plot]:
    spectrum, curve = f"decay-spectrum-{number}", f"decay-{number}"
    return (
        Plot(
            inline_svg(decay_spectrum_figure(fit.spectrum), spectrum, f"Spectrum of the free decay {fit.name}"),
            spectrum,
            f"{fit.name}: amplitude of the tail markers under the falling half of a Hann window, the peak, and the "
            "frequency of the zero crossings with its 95 % interval.",
        ),
        Plot(
            inline_svg(decay_curve_figure(fit), curve, f"Free decay {fit.name} beside the twin’s"),
            curve,
            f"{fit.name}: tail markers after the release (dots) and the twin with the fitted hinges (lines), about the "
            "straight tail.",
            wide=True,
        ),
    )


def _caveats(fits: Sequence[DecayFit]) -> tuple[str, ...]:
    of_each = [sentence(f"{fit.name}: {flag.message}") for fit in fits for flag in fit.flags]
    return (*of_each, *(sentence(flag.message) for flag in combine_decays(fits).flags))
