"""The square-root scale of the search, which every figure of coefficients shares."""

import numpy as np
from matplotlib.axes import Axes

from fitting.objective import COEFFICIENT_BOUNDS
from swimmer import FluidCoefficients

NAMES = tuple(name.replace("_", " ") for name in FluidCoefficients._fields)
LOW, HIGH = (float(root) for root in np.sqrt(COEFFICIENT_BOUNDS))
TICKS = (0.0, 0.1, 0.5, 1.0, 2.0, 4.0, 7.0, 10.0)


def scale_by_root(axes: Axes, ticks: tuple[float, ...] = TICKS) -> None:
    """The horizontal axis of a coefficient, within its bounds; what is drawn on it is its square root."""
    within = [tick for tick in ticks if LOW <= np.sqrt(tick) <= HIGH]
    axes.set_xticks(np.sqrt(within), [f"{tick:g}" for tick in within])
    axes.set_xlim(LOW - 0.08, HIGH + 0.08)
