"""Priors and thresholds of a diagnosis, each with where it is from.

*Development*: fitted to synthetic sessions of development, see docs/benchmarks.md. *Convention*: a usual level.
"""

import numpy as np

# Verdict
ALARM = 0.98
"""Probability of a gap, below which there is none. Development; docs/benchmarks.md has how often nulls reach it."""
ENOUGH = 0.9
"""Probability, if there is a gap, from which a few names are enough, they or what only looks like them. Convention."""
BESIDE = 0.6
"""The same in addition to names that are, where no group of alternatives has ENOUGH: a refit with and without decides.
Development."""
HELD = 0.5
"""Probability that one of them is present, below which no name is said: more likely than not."""
MOST_ALIKE = 3
"""Alternatives of a group; the public contract."""
LOOKED_AT = 10
"""Of the most probable effects, for a group: all sets of three of more would take long."""
MOST_LEFT = 0.5
"""Share of a gap beside a name, above which it is withdrawn if an unknown effect is more probable. Development."""
IN_FEATURES = 0.5
"""Share of the squares of what an effect does, from which it shows in features, not in frequencies: the larger part."""

# Prior
SIZES = np.geomspace(1.0, 1024.0, 6)
"""Root mean square whitened length of what an effect does: log-uniform from what is just seen to what bounds allow."""
SHOWS = 3.0
"""Whitened length from which something shows: three standard deviations."""
MOST_WRONG = 40.0
"""Whitened length beyond which a form is no more wrong in all: what is left then is something else. Development."""
LOOSE = 0.3
"""Share of the variance of something else that is like no effect. Development."""
OF_WATER = 0.1
"""How likely forces of the water at one place are, alike in all trials: there the twin's own error acts too."""
MIXED, NEEDED = 10.0, 7.0
"""Log Bayes factors: from which an unknown effect is a mixture of the catalogue, and one of its effects needed in it.
Development."""
PLACED = 0.5
"""Probability from which a place is reported: more likely than not."""
SCALES = {0.7: 0.3, 1.0: 0.45, 1.4: 0.18, 2.0: 0.07}
"""Of the twin's own error in a session, against most sessions, with the probability of each before it is looked at.

As in base sessions of the benchmark, with larger ones taken to be somewhat likelier than there.
"""
WITHIN = {"hinge_stiffness": 0.02, "hinge_damping": 0.05, "crank_arm": 0.005, "mass": 0.02}
"""Relative standard deviation of each number of a robot about its description, as well as dry experiments tell it."""
WIDER = 5.0
"""Than its own prior is that of a parameter beside which it is refitted, so that data decide."""
MOST_EFFECTS = 3
"""Effects at once."""
MOST_GROUPS = 5
"""Groups of alternatives that act together, of a mixture."""
PAIRED, GROWN, AT_PLACES = 8, 3, 12
"""Of the most probable effects, of which pairs are tried; sets that are tried with one more; sets with a place."""

# The twin's own error, measured against the second simulator (`python -m benchmarks.effects.discrepancy`)
COURSE_SD = (0.001, 0.001)
"""Of the speed sideways, m/s, and of the rate of turning, rad/s, where nothing is wrong."""
SLIDE_SD_M_S = 1e-5
"""Of the pace at which each marker slides along the fish, where nothing is wrong."""
NEAR = 0.3
"""Of the logarithm of two swims' frequencies, over which what is left of them is alike."""

# A gap of no particular cause, for one metre of displacement
SPEED_PER_M, COURSE_PER_M, SLIDE_PER_M = 1.0, (1.0, 6.0), 0.1
"""Forward, m/s; sideways, m/s, and turning, rad/s; a marker along the fish, m/s, as if that came in 10 s."""
HERTZ_PER_M, RING_PER_M = 2.0, 10.0
"""Of frequencies; of the logarithms of what free decays say: air leaves a tail little to go wrong by."""

# Skill on held-out trials
CLEAR = 3.0
"""Standard errors of the plain twin's squares above noise from which a skill is reported."""
LEAST_GAP = 0.1
"""Of the squares that the plain twin seems to leave, which it surely does where these are clear."""
FLOOR_SD = 0.09
"""Of the logarithm of F, from session to session: in 85 null sessions of development that of L_plain over F spreads by
0.12, of which noise of unit size makes 0.075."""
FEWEST_TRIALS = 3
"""Fitted swim trials for cross-validation: of two, the other one alone would have to tell coefficients and effects."""

# Ridge over all effects
SHARES = (0.1, 0.2, 0.35, 0.5, 0.7, 1.0)
"""Of the width of their priors that effects have."""
CALLED_FOR = 10.0
"""Log evidence that all effects have to gain beside those that are named: in 15 null sessions it was -12 at most."""
