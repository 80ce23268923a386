"""How to read the numbers: the definitions of the public contract, shortly."""

from fitting.trial import KNOWN_BEATS, SCORED_S
from reports.blocks import Section, Terms
from reports.context import ReportContext

TERMS = {
    "head frame": "In every frame all markers are rotated so that nose → neck is +x, with the nose as origin; each "
    "frame adds the head's displacement since the frame before, in that frame's axes. Forward is therefore −x; the "
    "robot's right is +y.",
    "marker distance": "Mean distance between measured and simulated marker in the head frame, over unflagged samples "
    f"of the first {SCORED_S:g} s after warm-up (held-out trials: of what follows their known part), aligned at the "
    "first of these frames. “Over all samples” counts the flagged ones too.",
    "shape alone": "The same relative to the nose in every frame: how the body bends, without its path.",
    "samples used": "Share of the samples in the scored window that are not flagged.",
    "speed": "Slope of the distance swum along the head's own axis, by least squares over the whole beats of the "
    "compared frames; forward is positive.",
    "speed error": "Predicted minus measured speed; in the summary its absolute value, averaged over trials.",
    "held out": "A held-out trial took no part in any fit: coefficients and session-wide numbers are frozen. Its "
    f"frequency, phase and start come from its own first {KNOWN_BEATS:g} beats, at most its first half; only the rest "
    "is compared. EBT gets the measured tail of the whole trial.",
    "EBT": "Elongated body theory. Steady form, as published: mean thrust ½ m (⟨hₜ²⟩ − U²⟨hₓ²⟩) with m = ¼ ρ π β d² "
    "balances drag ½ ρ c_D S U². “Smoothed” takes the lateral speed hₜ from a Savitzky-Golay filter instead of "
    "differences between frames, which the noise of tracks inflates; “large amplitude” keeps the angle of the tail "
    "tip and its motion along the path. All are fitted to the same fit trials by the same search.",
    "interval": "90 %. Of coefficients by the normal approximation at the mode, or of the posterior where so labelled; "
    "of gains over trials.",
    "flag": "A warning with its place, found by rule and not by hand. Flagged samples have no weight; a flag of a fit "
    "or of a trial is shown next to the numbers it concerns.",
    "boxes off, markers off": "The tracked shape of the fish needs a box displaced by more than 10 mm, which is more "
    "than an error of placing it by hand, or a marker more than 15 mm from where the robot's description has it. In "
    "the posterior: the standard deviation over all markers is more than 5 mm.",
    "extrapolated": "The trial beats slower or faster than every trial that was fitted.",
}


def build(context: ReportContext) -> Section:  # noqa: ARG001
    """The same for every session."""
    return Section("How to read this", "reading", (Terms(tuple(TERMS.items())),))
