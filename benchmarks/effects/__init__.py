"""`python -m benchmarks effects`: sessions whose effect is withheld from what diagnoses them, and scores of that."""
