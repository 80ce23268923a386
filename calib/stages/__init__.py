"""The stages of the work on a session, in order.

They are videos, recordings, structure, fit, posterior and diagnosis; the report's is in `calib.pipeline`. Each is a
`swimcal.stage.Stage`: inputs, their fingerprint, and the files it makes.
"""
