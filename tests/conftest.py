"""What holds for all tests."""

import os

from hypothesis import settings

# Property tests draw the same examples every time, so that a run on a clean clone proves the same as any other.
# HYPOTHESIS_PROFILE=explore draws new ones, to look for what nobody thought of.
# None is held to a time: how long one takes depends on what else the machine does.
settings.register_profile("same", derandomize=True, deadline=None)
settings.register_profile("explore", derandomize=False, deadline=None)
settings.load_profile(os.environ.get("HYPOTHESIS_PROFILE", "same"))
