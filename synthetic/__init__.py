"""Sessions made with the twin: swims, dry runs and free decays; tracking noise, track faults, motor logs, truth."""

from synthetic.decays import TrueDecay, simulate_decays
from synthetic.default import default_plan
from synthetic.driven import TrueMotor
from synthetic.faults import Freeze, Gap, Jump, Merge, TrackFault, with_faults
from synthetic.motor import SyntheticMotor
from synthetic.noise import NOISELESS, TrackingNoise
from synthetic.plan import PLAUSIBLE_COEFFICIENTS, SyntheticPlan
from synthetic.session import make_session
from synthetic.swims import TrueRun, simulate_dry_runs, simulate_swims
from synthetic.trials import SyntheticCamera, SyntheticDecay, SyntheticTrial
from synthetic.truth import TRUTH_FILE, DecayTruth, DryTruth, StructureTruth, TrialTruth, Truth, read_truth

__all__ = [
    "NOISELESS",
    "PLAUSIBLE_COEFFICIENTS",
    "TRUTH_FILE",
    "DecayTruth",
    "DryTruth",
    "Freeze",
    "Gap",
    "Jump",
    "Merge",
    "StructureTruth",
    "SyntheticCamera",
    "SyntheticDecay",
    "SyntheticMotor",
    "SyntheticPlan",
    "SyntheticTrial",
    "TrackFault",
    "TrackingNoise",
    "TrialTruth",
    "TrueDecay",
    "TrueMotor",
    "TrueRun",
    "Truth",
    "default_plan",
    "make_session",
    "read_truth",
    "simulate_decays",
    "simulate_dry_runs",
    "simulate_swims",
    "with_faults",
]
