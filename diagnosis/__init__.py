"""The sim-to-real gap: where it lies, which effect makes it, how far it shrinks with it, what to measure next."""

from diagnosis.diagnosis import Diagnosis, Settings, diagnose
from diagnosis.discrepancy import Discrepancy, discrepancy_for, shipped_discrepancy
from diagnosis.effect_test import EffectTest, weigh_effects
from diagnosis.session_data import SessionData
from diagnosis.verdict import Verdict

__all__ = [
    "Diagnosis",
    "Discrepancy",
    "EffectTest",
    "SessionData",
    "Settings",
    "Verdict",
    "diagnose",
    "discrepancy_for",
    "shipped_discrepancy",
    "weigh_effects",
]
