"""The section on how to read the numbers: the definitions of the public contract, in short."""

from fitting.trial import KNOWN_BEATS, SCORED_S
from reports.blocks import Section, Terms
from reports.context import ReportContext

TERMS = {
    "head frame": "In every frame all markers are rotated so that nose → neck is +x, with the nose as origin; each "
    "frame adds the head's displacement since the frame before. Forward is −x; the robot's right is +y.",
    "marker distance": "Mean distance between measured and simulated marker in the head frame, over unflagged samples "
    f"of the first {SCORED_S:g} s after warm-up (held-out trials: of what follows their known part), aligned at the "
    "first of these frames. “Shape alone”: relative to the nose in every frame.",
    "speed": "Slope of the distance swum along the head's own axis, by least squares over the whole beats of the "
    "compared frames; forward is positive.",
    "held out": "A held-out trial took no part in any fit. Its frequency, phase and start come from its own first "
    f"{KNOWN_BEATS:g} beats, at most its first half; only the rest is compared.",
    "EBT": "Elongated body theory as published: mean thrust ½ m (⟨hₜ²⟩ − U²⟨hₓ²⟩) with m = ¼ ρ π β d² balances drag "
    "½ ρ c_D S U². “Smoothed” takes the lateral speed hₜ from a smoothing filter; “large amplitude” keeps the angle "
    "of the tail tip.",
    "simple rules": "A line and a power law in frequency, and a constant stride (speed in proportion to frequency), "
    "through the speeds of the fit trials.",
    "determined": "The upper end of a coefficient’s 90 % interval is at most 2.5 times the lower, or the interval no "
    "wider than 0.5, and it does not lie at a bound.",
    "extrapolated": "The trial beats slower or faster than every trial that was fitted.",
}


def build(context: ReportContext) -> Section:  # noqa: ARG001
    """Build the section, which is the same for every session."""
    return Section("What the words mean", "reading", (Terms(tuple(TERMS.items()), "Definitions of the measures"),))
