"""The five fluid coefficients: where they ended, how the search went, and how far they can be trusted."""

import numpy as np

from fitting import CoefficientFit
from fitting.objective import COEFFICIENT_BOUNDS
from reports.blocks import Column, Plot, Plots, Prose, Section, Table
from reports.context import ReportContext
from reports.figures import coefficients_figure, convergence_figure
from reports.numbers import MISSING, counted, in_mm, sentence, shown, significant
from reports.svg import inline_svg
from swimmer import PUBLISHED_COEFFICIENTS, FluidCoefficients

AS_GOOD = 1.01  # objective within this factor of the best: a start that fits as well

COLUMNS = (
    Column("coefficient", numeric=False),
    Column("value"),
    Column("published"),
    Column("range of equals"),
    Column("mind", numeric=False),
)


def build(context: ReportContext) -> Section:
    """Values with bounds, ends of all starts, and their way there."""
    fit = context.calibration.fit
    values = Plot(
        inline_svg(coefficients_figure(fit), "coefficient-values", "Coefficients within their bounds"),
        "coefficient-values",
        "Each coefficient within its bounds (grey). Dots where other starts ended: those far from the best "
        "and yet as good would mean that the data do not determine the coefficient. Crosses swim backward "
        "from rest, which the robot does not.",
    )
    ways = Plot(
        inline_svg(convergence_figure(fit), "convergence", "Objective after each iteration of each start"),
        "convergence",
        "The objective, a softened mean marker distance, after each iteration of each start. A filled end "
        "converged; an open one ran out of iterations or was given up for a better start.",
    )
    text = (
        f"{counted(len(fit.restarts), 'start')}, {fit.evaluations} simulations of the fit trials, "
        f"{shown(fit.seconds)} s. At the best, the mean marker distance over the fit trials is "
        f"{in_mm(fit.mean_distance_m)} mm. {_agreement(fit)}"
    )
    caveats = tuple(sentence(flag.message or flag.kind) for flag in fit.flags)
    return Section("Fluid coefficients", "coefficients", (Plots((values, ways)), Prose(text), _table(fit)), caveats)


def _equals(fit: CoefficientFit) -> np.ndarray:
    """(r, 5) the coefficients of the starts that fit as well as the best and swim the same way from rest."""
    if not fit.restarts:
        return np.array([fit.coefficients], float)
    best = fit.restarts[0]
    peers = [restart for restart in fit.restarts if restart.swims_forward == best.swims_forward]
    return np.array([r.coefficients for r in peers if r.objective_m <= AS_GOOD * best.objective_m], float)


def _agreement(fit: CoefficientFit) -> str:
    equals = len(_equals(fit))
    if equals == 1:
        return "No other start came within 1 % of it."
    return f"{equals} starts fit equally well (within 1 %); the table shows how far apart they are."


def _range(values: np.ndarray) -> str:
    """Least and greatest of several."""
    return MISSING if len(values) == 1 else f"{significant(values.min())} to {significant(values.max())}"


def _table(fit: CoefficientFit) -> Table:
    equals = _equals(fit)
    low, high = COEFFICIENT_BOUNDS
    rows = []
    for i, name in enumerate(FluidCoefficients._fields):
        mind = [flag.kind.replace("_", " ") for flag in fit.flags if name in flag.message]
        rows.append(
            (
                name.replace("_", " "),
                significant(fit.coefficients[i]),
                significant(PUBLISHED_COEFFICIENTS[i]),
                _range(equals[:, i]),
                ", ".join(mind) or MISSING,
            )
        )
    caption = (
        f"Coefficients of the fluid forces (no unit), bounds {low:g} to {high:g}. “Equals” are the starts "
        "whose objective lies within 1 % of the best; “published” values belong to the authors' own model."
    )
    return Table(caption, COLUMNS, tuple(rows))
