"""The sim-to-real gap: where it lies, which effect makes it, how far it shrinks with it, what to measure next."""

from diagnosis.diagnosis import Diagnosis, Settings, diagnose
from diagnosis.discrepancy import Discrepancy, discrepancy_for, shipped_discrepancy
from diagnosis.session_data import SessionData
from diagnosis.supposition import Supposition, suppose
from diagnosis.verdict import Verdict

__all__ = [
    "Diagnosis",
    "Discrepancy",
    "SessionData",
    "Settings",
    "Supposition",
    "Verdict",
    "diagnose",
    "discrepancy_for",
    "shipped_discrepancy",
    "suppose",
]
