"""Reports: one self-contained HTML page a session, an index for several, and the figures of both."""
