"""The stages of the work on a session, in order.

They are videos, recordings, structure, fit, evidence, posterior, diagnosis, report and recording. Each is a
`swimcal.stage.Stage`: inputs, their fingerprint, and the files it makes.
"""
