"""The section on policies: what the twin can be steered to, by distance and angle, and how near it follows a circle."""

from itertools import pairwise

import numpy as np
from scipy.stats import binomtest

from reports.blocks import Plot, Plots, Prose, Section, Table, table_head
from reports.context import ReportContext
from reports.figures.steering import RINGS_M, SIDES_RAD, circle_figure, paths_figure, reach_figure
from reports.numbers import MM, counted, percent, shown, spanned
from reports.policy_swims import PolicySwims

METHODS = {"search": "A steering law of a few numbers, searched", "sac": "A network, trained with soft actor-critic"}
REACH = table_head("targets | episodes [] | reached [] | 95 % interval [] | median time [s] | slowest tenth from [s]")
CIRCLE = table_head("circle | lap [s] | mean distance [mm] | largest [mm]")
ON_THE_TWIN = (
    "These swims are the twin’s own, on which the policy was made. On the robot it does no better than the twin is "
    "right; docs/policies.md has what was measured of that on a second simulator."
)


def build(context: ReportContext) -> Section | None:
    """Build the section; None where no policy was trained."""
    if not context.policies:
        return None
    caveats = [ON_THE_TWIN]
    for swims in context.policies:
        if not swims.of_this_fit:
            caveats.append(f"The policy for {swims.task} is of another fit than this report; train it again.")
        if swims.diverged.any():
            caveats.append(f"{swims.task}: {counted(int(swims.diverged.sum()), 'simulation')} diverged.")
    blocks = [block for swims in context.policies for block in (_targets if swims.task == "target" else _circle)(swims)]
    return Section("Steering", "steering", tuple(blocks), tuple(caveats))


def _describe_training(swims: PolicySwims) -> str:
    minutes = f"{shown(swims.trained_s / 60, 1 if swims.trained_s < 600 else 0)} min"
    return f"{METHODS.get(swims.method, swims.method)} for {minutes} on this twin (seed {swims.seed})"


def _targets(swims: PolicySwims) -> tuple[Prose | Plots | Table, ...]:
    hits, count = int(swims.reached.sum()), len(swims.reached)
    low, high = _wilson(hits, count)
    text = (
        f"{_describe_training(swims)}, reaches {hits} of {count} random targets ({spanned(low, high, percent)}, "
        f"95 % interval), in the median after {shown(_median(swims, swims.reached))} s."
    )
    paths = Plot(
        paths_figure(swims),
        "steering-paths",
        f"The first {swims.path_m.shape[1]} ways to a target, from above. It begins at rest, where the arrow is. "
        "A way ends within reach of its target, or when its time is over.",
    )
    reach = Plot(
        reach_figure(swims),
        "steering-reach",
        "Targets by distance and angle: the share reached, and the median time that it took. A near target to the "
        "side is within the turning circle, so the robot turns away first. Without numbers: too near, or too few.",
    )
    return (Prose(text), Plots((paths, reach)), _by_distance_and_angle(swims))


def _by_distance_and_angle(swims: PolicySwims) -> Table:
    distance, aside = swims.distance_m, np.degrees(swims.aside_rad)
    rows = []
    for low, high in pairwise(RINGS_M):
        rows += _row(f"{low:g} to {high:g} m away", swims, (distance >= low) & (distance < high))
    degrees = np.degrees(SIDES_RAD)
    for low, high in pairwise(degrees):
        rows += _row(f"{low:.0f} to {high:.0f}° aside", swims, (aside >= low) & (aside < high))
    everything = _row("all", swims, np.ones(len(distance), bool))
    return Table("Targets reached, by distance and by angle.", REACH, tuple(rows), tuple(everything))


def _row(label: str, swims: PolicySwims, chosen: np.ndarray) -> list[tuple[str, ...]]:
    count, hit = int(chosen.sum()), chosen & swims.reached
    if not count:
        return []
    low, high = _wilson(int(hit.sum()), count)
    slow = float(np.quantile(swims.seconds[hit], 0.9)) if hit.any() else None
    interval = spanned(low, high, percent)
    return [(label, str(count), percent(hit.sum() / count), interval, shown(_median(swims, hit)), shown(slow))]


def _wilson(hits: int, count: int) -> tuple[float, float]:
    """Compute the 95 % interval of a share (Wilson 1927)."""
    low, high = binomtest(hits, count).proportion_ci(0.95, method="wilson")
    return float(low), float(high)


def _median(swims: PolicySwims, hit: np.ndarray) -> float | None:
    return float(np.median(swims.seconds[hit])) if hit.any() else None


def _circle(swims: PolicySwims) -> tuple[Prose | Plots | Table, ...]:
    mean, largest = swims.off_path_m * MM
    rows = []
    for number, start in enumerate(swims.start_m):
        lap = shown(float(swims.seconds[number])) if swims.reached[number] else "not finished"
        side = "to the left" if start[1] < 0 else "to the right"
        rows.append((side, lap, shown(float(mean[number])), shown(float(largest[number]))))
    text = (
        f"{_describe_training(swims)}, follows a circle of {swims.radius_m:g} m at {shown(float(mean.mean()))} mm from "
        f"it in the mean and {shown(float(largest.max()))} mm at most. These are the two episodes that it was searched "
        "on."
    )
    figure = Plot(
        circle_figure(swims),
        "steering-circle",
        "The circle to either side, from rest. Left: from above, the circle in grey. Right: the distance from it along "
        "the lap; the fast ripple is the head that swings with every beat.",
    )
    return (Prose(text), Plots((figure,)), Table("The circle to either side.", CIRCLE, tuple(rows)))
