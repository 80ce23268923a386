"""Sessions made with the twin, and their truth: swim trials, dry runs, free decays, tracking noise, motor logs."""

from synthetic.default import default_plan
from synthetic.noise import TrackingNoise
from synthetic.plan import PLAUSIBLE_COEFFICIENTS, SyntheticPlan
from synthetic.session import make_session
from synthetic.swims import simulate_swims
from synthetic.trials import SyntheticCamera, SyntheticTrial
from synthetic.truth import Truth, read_truth

__all__ = [
    "PLAUSIBLE_COEFFICIENTS",
    "SyntheticCamera",
    "SyntheticPlan",
    "SyntheticTrial",
    "TrackingNoise",
    "Truth",
    "default_plan",
    "make_session",
    "read_truth",
    "simulate_swims",
]
