"""The sim-to-real gap: where it lies, which effect makes it, how far it shrinks with it, what to measure next."""

from diagnosis.diagnosis import Diagnosis, Gap, Settings, diagnose
from diagnosis.discrepancy import Discrepancy, discrepancy_for, shipped_discrepancy
from diagnosis.evidence import Belief
from diagnosis.probabilities import Probabilities
from diagnosis.supposition import Supposition, suppose
from diagnosis.verdict import Verdict
from diagnosis.where import STAGES, Where

__all__ = [
    "STAGES",
    "Belief",
    "Diagnosis",
    "Discrepancy",
    "Gap",
    "Probabilities",
    "Settings",
    "Supposition",
    "Verdict",
    "Where",
    "diagnose",
    "discrepancy_for",
    "shipped_discrepancy",
    "suppose",
]
