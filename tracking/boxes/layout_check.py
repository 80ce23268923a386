"""Given boxes against the robot: an order or a spacing that no pose of it can have is a fault.

People place boxes loosely, and the real robot's tail root is at three times the layout's distance from the dorsal
fin: only what is far beyond that is refused. In the first frames of the public trials the boxes depart by at most 2.5
standard deviations of `body_chain.Spread`; with two neighbours exchanged, by 9 and more. The dorsal fin and the first
marker of the tail are the exception: exchanged, they depart by 2 to 7, and may pass.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import combinations

import numpy as np

from session import FaultCollector
from tracking.boxes.body_chain import FoundStep, found_steps

IMPOSSIBLE = 6.0
"""Standard deviations beyond which a step along the body cannot be."""
LIKELY = 3.0
"""Standard deviations to which an exchange must bring every step to be suggested."""


def check_layout(names: Sequence[str], centre_px: np.ndarray, layout_m: np.ndarray, faults: FaultCollector) -> None:
    """Add a fault for every step along the body that the robot cannot take; scale, heading and bend are free.

    Args:
        names: names of the m markers.
        centre_px: (m, 2) centres of the boxes, px, no two on one spot.
        layout_m: (m, 2) marker positions on the straight robot, m.
        faults: takes the faults.
    """
    try:
        taken = found_steps(centre_px, layout_m)
    except ValueError:  # too few markers in a row to tell
        return
    impossible = [each for each in taken if each.off > IMPOSSIBLE]
    hint = _exchange(names, centre_px, layout_m) if impossible else ""
    for each in impossible:
        before, marker = names[each.step.before], names[each.step.marker]
        step = hint or "Look at the markers' names, or click them again: `calib track SESSION --click`."
        what, found, expected = f"no place for {marker} behind {before}", _found(each, names), _expected(each, layout_m)
        faults.add(f"boxes.{marker}", what, found=found, expected=expected, next_step=step)


def _found(taken: FoundStep, names: Sequence[str]) -> str:
    """Describe the step in mm at the scale of the head, and its direction."""
    behind, front = (names[k] for k in taken.step.along)
    degrees = f"{abs(taken.bend_deg):.0f} degrees to the way from {behind} to {front}"
    return f"{1000 * taken.length_m:.0f} mm from it, at {degrees}"


def _expected(taken: FoundStep, layout_m: np.ndarray) -> str:
    spread = taken.step.spread
    wanted_m = layout_m[taken.step.marker] - layout_m[taken.step.before]
    if np.isfinite(spread.place_m):
        x, y = 1000 * wanted_m
        return f"{x:.0f} mm behind and {y:.0f} mm beside it, to within {1000 * IMPOSSIBLE * spread.place_m:.0f} mm"
    usual_mm = 1000 * float(np.linalg.norm(wanted_m)) * spread.stretch
    low, high = usual_mm * np.exp([-IMPOSSIBLE * spread.length, IMPOSSIBLE * spread.length])
    return f"{low:.0f} to {high:.0f} mm, at {IMPOSSIBLE * spread.bend_deg:.0f} degrees or less"


def _exchange(names: Sequence[str], centre_px: np.ndarray, layout_m: np.ndarray) -> str:
    """Describe the exchange of two names after which all would fit best; an empty text if none makes it fit."""
    worst = {}
    for one, other in combinations(range(len(names)), 2):
        order = np.arange(len(names))
        order[[one, other]] = other, one
        worst[one, other] = max(each.off for each in found_steps(centre_px[order], layout_m))
    (one, other), off = min(worst.items(), key=lambda item: item[1])
    return f"Exchange {names[one]} and {names[other]}: then they would fit." if off <= LIKELY else ""
