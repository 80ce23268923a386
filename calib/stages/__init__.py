"""The stages of the work on a session, in order: videos, recordings, structure, fit, evidence, posterior, diagnosis,
report, recording. Each is a `session.stage.Stage`: inputs, their fingerprint, and the files it makes.
"""
