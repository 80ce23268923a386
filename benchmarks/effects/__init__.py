"""`calib benchmark effects`: sessions whose effect is withheld from what diagnoses them, and scores of that."""
