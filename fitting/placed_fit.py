"""The fit with boxes where they most likely were put, beside the plain fit and never instead of it."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from fitting.coefficient_fit import CoefficientFit
from fitting.coefficients import refine_coefficients
from fitting.forecast import SETTLED_S, fit_phase, forecast
from fitting.objective import Swims
from fitting.placement import BoxesOff, place
from fitting.scoring import score
from fitting.trial import MeasuredTrial
from session import Flag
from swimmer import FluidCoefficients, Twin

FAR_M = 0.010  # off its marker, each way, a hand does not put a box: it stands for something else
FAR_MARKER_M = 0.015
ITERATIONS = 12


@dataclass(frozen=True)
class PlacedTrial:
    """One swim beside the twin of the placed fit.

    Attributes:
        name: of the trial.
        boxes, boxes_sd: how far its boxes are off, and the standard deviation of that; from the known part of a
            held-out trial.
        distance_m: mean marker distance as the public contract defines it, but with the placement, m.
        shape_m: the same relative to the nose in every frame, m.
    """

    name: str
    boxes: BoxesOff
    boxes_sd: BoxesOff
    distance_m: float
    shape_m: float


@dataclass(frozen=True, eq=False)
class PlacedFit:
    """The fit with the likeliest placement.

    Attributes:
        coefficients: with it.
        mean_distance_m: the objective with it, m.
        converged: the descent ended before its iterations ran out; it begins at the plain fit, so even then
            `mean_distance_m` is an upper bound.
        markers: names of the m markers.
        marker_m, marker_sd_m: (m, 2) of each beside its described place, along and across, and the standard
            deviation.
        trials: all swims.
    """

    coefficients: FluidCoefficients
    mean_distance_m: float
    converged: bool
    markers: tuple[str, ...]
    marker_m: np.ndarray
    marker_sd_m: np.ndarray
    trials: tuple[PlacedTrial, ...]

    @property
    def flags(self) -> tuple[Flag, ...]:
        """Boxes farther off than a hand puts them, markers far from where the robot's description has them."""
        found = []
        for trial in self.trials:
            off_m = float(np.max(np.abs(trial.boxes)))
            if not off_m <= FAR_M:
                message = (
                    f"trial {trial.name}: the boxes of nose and neck would have to be {1000 * off_m:.0f} mm off, "
                    "more than a hand misses: something turns or bends the fish that the twin does not have"
                )
                found.append(Flag("boxes_off", message=message))
        far = [
            f"{name} ({1000 * along:+.0f} mm along, {1000 * across:+.0f} mm across)"
            for name, (along, across) in zip(self.markers, self.marker_m, strict=True)
            if np.hypot(along, across) > FAR_MARKER_M
        ]
        if far:
            message = f"far from where the robot's description has them: {', '.join(far)}; measure where they sit"
            found.append(Flag("markers_off", message=message))
        return tuple(found)


def fit_placed(trials: Sequence[MeasuredTrial], twin: Twin, fit: CoefficientFit) -> PlacedFit:
    """The fit with boxes where they most likely were put, from the plain fit.

    Args:
        trials: all swims; the coefficients and the markers' places are found from those of the role "fit" alone, the
            boxes of the others from their known parts.
        twin: with their markers.
        fit: the plain fit of the same fit trials, in the same order.
    """
    fitted = tuple(trial for trial in trials if trial.role == "fit")
    found = refine_coefficients(Swims(twin, fitted, "placed"), [fit.restarts[0].point], ITERATIONS, central=False)
    phases = dict(zip([trial.name for trial in fitted], found.phase_rad, strict=True))
    heads = {}
    for trial in trials:
        phase = phases.get(trial.name)
        phase = fit_phase(twin, trial, found.coefficients) if phase is None else float(phase)
        heads[trial.name] = forecast(twin, trial, found.coefficients, phase)
    together = place(fitted, [heads[trial.name] for trial in fitted])
    told = []
    for trial in trials:
        head, own = heads[trial.name], together
        if trial.role != "fit":
            own = place([trial], [head], [trial.known & (trial.time_s > SETTLED_S)], together)
        seen, name = score(trial, own.seen(trial, head)), trial.name
        told.append(PlacedTrial(name, own.boxes[name], own.boxes_sd[name], seen.marker_error_m, seen.shape_error_m))
    return PlacedFit(
        found.coefficients,
        found.mean_distance_m,
        found.restarts[0].converged,
        twin.markers,
        together.marker_m,
        together.marker_sd_m,
        tuple(told),
    )
