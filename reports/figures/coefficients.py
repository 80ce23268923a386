"""The coefficients between their bounds: where searches ended, how the objective rises, how it came down."""

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, LogLocator, MaxNLocator, NullFormatter

from fitting import CoefficientFit
from fitting.objective import COEFFICIENT_BOUNDS
from fitting.pairs import PairFit
from fitting.profile import CoefficientProfiles
from reports.colours import INK, MUTED, SHADE, TWIN, WARN
from reports.numbers import MM, in_words
from reports.style import (
    HALF_WIDTH_IN,
    Grid,
    Look,
    Margins,
    legend_above,
    legend_on_top,
    name_panels,
    panel,
    panels,
    styled,
)
from swimmer import PUBLISHED_COEFFICIENTS, FluidCoefficients

NAMES = tuple(map(in_words, FluidCoefficients._fields))
_LOW, _HIGH = (float(root) for root in np.sqrt(COEFFICIENT_BOUNDS))
_TICKS = (0.0, 0.1, 0.5, 1.0, 2.0, 4.0, 7.0, 10.0)
_HIGHEST = 2.0  # times the best distance, where the panel of a profile ends
_WORST = 1.5  # times the best distance, where the panel of a search ends
_DECADES = 1.5  # of simulated time from which ticks are one a decade


@styled
def coefficients_figure(fit: CoefficientFit) -> Figure:
    """Each coefficient within its bounds, on the square-root scale of the search; dots are ends."""
    figure, axes, rows = bounded_panel(3.3)
    best, bound = np.sqrt(fit.coefficients), coefficients_at_bound(fit)
    for chosen, colour, label in ((~bound, TWIN, "best"), (bound, WARN, "best, at its bound")):
        if chosen.any():
            axes.plot(best[chosen], rows[chosen], "D", color=colour, markersize=6, label=label, zorder=3)
    published: Look = {"markersize": 11, "markeredgewidth": 1.6, "zorder": 2.5, "label": "published"}
    axes.plot(np.sqrt(PUBLISHED_COEFFICIENTS), rows, "|", color=INK, **published)
    for restart in fit.restarts[1:]:
        mark, label = ("o", "other starts") if restart.swims_forward else ("x", "backward")
        axes.plot(np.sqrt(restart.coefficients), rows, mark, color=MUTED, markersize=3.5, alpha=0.7, label=label)
    legend_above(axes, 3, columnspacing=1.0, handletextpad=0.3)
    return figure


def bounded_panel(height_in: float) -> tuple[Figure, Axes, np.ndarray]:
    """A panel with a grey bar for each coefficient from bound to bound, square roots across, and the rows (5,)."""
    figure, axes = panel(HALF_WIDTH_IN, height_in, Margins(left=1.0, top=0.5))
    rows = -np.arange(len(NAMES))
    axes.barh(rows, _HIGH - _LOW, left=_LOW, height=0.5, color=SHADE)
    axes.set_yticks(rows, NAMES)
    axes.set_xlabel("coefficient (no unit; square-root scale)")
    axes.grid(visible=False, axis="y")
    _scale_by_root(axes, _TICKS)
    return figure, axes, rows


def _scale_by_root(axes: Axes, ticks: tuple[float, ...]) -> None:
    """The horizontal axis of a coefficient, within its bounds; what is drawn on it is its square root."""
    within = [tick for tick in ticks if _LOW <= np.sqrt(tick) <= _HIGH]
    axes.set_xticks(np.sqrt(within), [f"{tick:g}" for tick in within])
    axes.set_xlim(_LOW - 0.08, _HIGH + 0.08)


def coefficients_at_bound(fit: CoefficientFit) -> np.ndarray:
    """(5,) True where a flag says that the coefficient lies at its bound."""
    messages = [flag.message for flag in fit.flags if flag.kind == "at_bound"]
    return np.array([any(name in message for message in messages) for name in FluidCoefficients._fields])


@styled
def coefficient_profiles_figure(profiles: CoefficientProfiles, best: FluidCoefficients) -> Figure:
    """A panel for each coefficient, all to one scale: all else held, all else following, and where restarts ended."""
    figure, drawn = panels(len(NAMES), Grid(2, 0.66, gap_in=(0.2, 0.34)), HALF_WIDTH_IN, Margins(left=0.5, top=0.6))
    lowest = np.nanmin(profiles.profile_m, initial=profiles.best_m) * MM
    for i, axes in enumerate(drawn):
        at = np.searchsorted(profiles.value[i], best[i])  # both curves pass through the fit
        root = np.sqrt(np.insert(profiles.value[i], at, best[i]))
        held = np.insert(profiles.slice_m[i], at, profiles.best_m)
        value, follows = profiles.curve(i, best[i])
        axes.plot(np.sqrt(value), follows * MM, color=TWIN, linewidth=1.4, label="all else follows", zorder=2.1)
        axes.plot(root, held * MM, color=MUTED, linewidth=0.9, linestyle=(0, (3, 2)), label="all else held")
        fitted: Look = {"color": TWIN, "markersize": 4.5, "label": "fit", "zorder": 2.3}
        axes.plot(np.sqrt(best[i]), profiles.best_m * MM, "D", **fitted)
        starts: Look = {"color": MUTED, "markersize": 3, "label": "other starts", "zorder": 2.2}
        axes.plot(np.sqrt(profiles.restart[:, i]), profiles.restart_m * MM, "o", **starts)
        _scale_by_root(axes, (0.0, 0.5, 2.0, 5.0, 10.0))
        axes.set_ylim(0.95 * lowest, _HIGHEST * profiles.best_m * MM)
        axes.locator_params(axis="y", nbins=4)
    name_panels(drawn, NAMES, 2)
    drawn[2].set_ylabel("mean marker distance (mm)")
    drawn[-1].set_xlabel("coefficient (square-root scale)")
    legend_on_top(figure, 2)
    return figure


@styled
def convergence_figure(fit: CoefficientFit) -> Figure:
    """The softened mean distance after each iteration; filled ends converged, open ones were stopped."""
    figure, axes = panel(HALF_WIDTH_IN, 2.9, Margins(top=0.5))
    first: Look = {"color": TWIN, "linewidth": 1.8, "zorder": 3, "label": "best"}
    for rank, restart in enumerate(fit.restarts):
        label = "backward" if not restart.swims_forward else "converged" if restart.converged else "stopped early"
        look = first if rank == 0 else {"color": MUTED, "linewidth": 0.9, "alpha": 0.7, "label": label}
        line, face = "-" if restart.swims_forward else ":", look["color"] if restart.converged else "none"
        end: Look = {"marker": "o", "markevery": [-1], "markersize": 4.5, "markerfacecolor": face}
        axes.plot(restart.history_m * MM, line, **look, **end)
    axes.xaxis.set_major_locator(MaxNLocator(integer=True))
    axes.set_xlabel("iteration")
    axes.set_ylabel("objective (mm)")
    legend_above(axes, 2)
    return figure


@styled
def search_trace_figure(fit: CoefficientFit) -> Figure:
    """Steps down to the end of the search, over the time that it had simulated; the marker is where it ended."""
    figure, axes = panel(HALF_WIDTH_IN, 3.3, Margins(top=0.5))
    trace = np.array(fit.trace)  # (k, 2) simulated seconds, best mean distance so far in m
    time_s = np.append(trace[:, 0], max(fit.spent_s, trace[-1, 0]))
    value = np.append(trace[:, 1], trace[-1, 1]) * MM
    axes.plot(time_s, value, color=TWIN, drawstyle="steps-post", linewidth=1.3, label="best so far")
    axes.plot(time_s[-1], value[-1], "o", color=TWIN, markersize=3.5)
    axes.set_xscale("log")
    axes.set_ylim(0.96 * value[-1], min(1.02 * axes.get_ylim()[1], _WORST * value[-1]))
    first, last = axes.get_xlim()
    axes.xaxis.set_major_locator(LogLocator(subs=(1.0,) if last > 10**_DECADES * first else (1.0, 2.0, 5.0)))
    axes.xaxis.set_minor_formatter(NullFormatter())
    axes.xaxis.set_major_formatter(FuncFormatter(lambda value, _position: f"{value:,.0f}".replace(",", " ")))
    axes.yaxis.set_major_locator(MaxNLocator(5))
    axes.set_xlabel("simulated time (s)")
    axes.set_ylabel("best mean marker distance (mm)")
    legend_above(axes, 2)
    return figure


@styled
def pair_coefficients_figure(pairs: Sequence[PairFit], best: FluidCoefficients) -> Figure:
    """Dots are pairs, the diamond is the session's own fit; crosses swim backward from rest."""
    figure, axes, rows = bounded_panel(2.76)
    axes.plot(np.sqrt(best), rows, "D", color=TWIN, markersize=6, label="this session’s fit", zorder=3)
    for pair, below in zip(pairs, spread_of(len(pairs), 0.4), strict=True):
        mark, label = ("o", "a pair") if pair.swims_forward else ("x", "backward")
        axes.plot(np.sqrt(pair.coefficients), rows + below, mark, color=MUTED, markersize=3.5, label=label)
    legend_above(axes, 3)
    return figure


def spread_of(count: int, width: float) -> np.ndarray:
    """(count,) places of dots in a row, evenly over a part of its height."""
    return np.linspace(-width / 2, width / 2, count) if count > 1 else np.zeros(1)
