"""Sessions made with the twin: tracking noise, track faults, filmed swims, known truth."""

from synthetic.card import write_card
from synthetic.default import default_plan
from synthetic.faults import Freeze, Gap, Jump, Merge, TrackFault, with_faults
from synthetic.filmed import SessionVideo
from synthetic.noise import NOISELESS, TrackingNoise
from synthetic.plan import PLAUSIBLE_COEFFICIENTS, SyntheticCamera, SyntheticPlan, SyntheticTrial
from synthetic.session import make_session
from synthetic.swims import TrueSwim, simulate_swims
from synthetic.truth import TRUTH_FILE, TrialTruth, Truth, read_truth

__all__ = [
    "NOISELESS",
    "PLAUSIBLE_COEFFICIENTS",
    "TRUTH_FILE",
    "Freeze",
    "Gap",
    "Jump",
    "Merge",
    "SessionVideo",
    "SyntheticCamera",
    "SyntheticPlan",
    "SyntheticTrial",
    "TrackFault",
    "TrackingNoise",
    "TrialTruth",
    "TrueSwim",
    "Truth",
    "default_plan",
    "make_session",
    "read_truth",
    "simulate_swims",
    "with_faults",
    "write_card",
]
