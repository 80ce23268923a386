"""The figures of the report, in a file a subject; each function returns a matplotlib `Figure`."""
