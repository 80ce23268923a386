"""Priors and thresholds of a diagnosis, each with its origin.

*Development*: fitted to synthetic sessions of development, see docs/benchmarks.md. *Convention*: a usual level.
"""

import numpy as np

# Verdict
ALARM = 0.98
"""Least probability of a gap for an alarm. Development; docs/benchmarks.md has how often null sessions reach it."""
ENOUGH = 0.9
"""Least probability, given a gap, that one of the named effects, or a look-alike, is present. Convention."""
BESIDE = 0.6
"""Least such probability of further names, if no group of alternatives has ENOUGH; refits decide then. Development."""
HELD = 0.5
"""Least probability that one of the effects themselves is present for a name: more likely than not."""
MOST_ALIKE = 3
"""Largest number of alternatives in a group; the public contract."""
LOOKED_AT = 10
"""Number of the most probable effects that a group is chosen from: all sets of three of more would take long."""
MOST_LEFT = 0.5
"""Unexplained share of a gap above which names are withdrawn if an unknown effect is more probable. Development."""
IN_FEATURES = 0.5
"""Share of an effect's squares from which it counts as visible in features, not in frequencies: the larger part."""

# Prior
SIZES = np.geomspace(1.0, 1024.0, 6)
"""Root mean square whitened norms of an effect: log-uniform from what is just detectable to what bounds allow."""
SHOWS = 3.0
"""Whitened norm from which an effect is detectable: three standard deviations."""
MOST_WRONG = 40.0
"""Largest whitened norm of a form error: a larger residual is due to something else. Development."""
LOOSE = 0.3
"""Share of the variance of an unknown effect that is like no effect of the catalogue. Development."""
OF_WATER = 0.1
"""Prior weight of water forces at one place that are the same in all trials: there the twin's own error acts too."""
MIXED = 10.0
"""Log Bayes factor from which an unknown effect counts as a mixture of the catalogue. Development."""
NEEDED = 7.0
"""Log Bayes factor from which such a mixture needs one of its effects. Development."""
PLACED = 0.5
"""Probability from which a place is reported: more likely than not."""
SCALES = {0.7: 0.3, 1.0: 0.45, 1.4: 0.18, 2.0: 0.07}
"""Prior probabilities of the size of the twin's own error in a session, relative to most sessions.

As in base sessions of the benchmark, with larger ones taken to be somewhat likelier than there.
"""
WITHIN = {"hinge_stiffness": 0.02, "hinge_damping": 0.05, "crank_arm": 0.005, "mass": 0.02}
"""Relative standard deviation of each number of a robot about its description, as dry experiments determine it."""
WIDER = 5.0
"""Factor on the width of a parameter's prior in a refit, so that the data decide."""
MOST_EFFECTS = 3
"""Largest number of effects in one hypothesis."""
MOST_GROUPS = 5
"""Largest number of groups of alternatives that act together, in a mixture."""
PAIRED = 8
"""Number of the most probable effects of which all pairs are tried."""
GROWN = 3
"""Number of the most probable sets that are tried with one more effect."""
AT_PLACES = 12
"""Number of the most probable sets that are tried with an unknown effect at one place."""

# The twin's own error, measured against the second simulator (`python -m benchmarks.effects.discrepancy`)
COURSE_SD = (0.001, 0.001)
"""Standard deviations of the speed sideways, m/s, and of the rate of turning, rad/s, where nothing is wrong."""
SLIDE_SD_M_S = 1e-5
"""Standard deviation of the speed at which each marker slides along the fish, where nothing is wrong."""
NEAR = 0.3
"""Length scale of the discrepancy's correlation, in the logarithm of two swims' frequencies."""

# A gap of no particular cause, for one metre of displacement
SPEED_PER_M = 1.0
"""Difference of the forward speed, m/s."""
COURSE_PER_M = (1.0, 6.0)
"""Differences of the speed sideways, m/s, and of the rate of turning, rad/s."""
SLIDE_PER_M = 0.1
"""Difference of a marker's speed along the fish, m/s, as if it slid as far in 10 s."""
HERTZ_PER_M = 2.0
"""Difference of frequencies, Hz."""
RING_PER_M = 10.0
"""Difference of the logarithms of a free decay's numbers: in air little can be wrong with a tail."""

# Skill on held-out trials
CLEAR = 3.0
"""Standard errors by which the plain twin's squares must exceed noise for a skill to be reported."""
LEAST_GAP = 0.1
"""Least share of the plain twin's excess squares that draws keep: the excess is certain where it is reported."""
FLOOR_SD = 0.09
"""Standard deviation of the logarithm of F between sessions.

In 85 null sessions of development the logarithm of L_plain over F spreads by 0.12, of which noise of unit size makes
0.075.
"""
FEWEST_TRIALS = 3
"""Fitted swim trials for cross-validation: with two, a single one would have to determine coefficients and effects."""

# Ridge over all effects
SHARES = (0.1, 0.2, 0.35, 0.5, 0.7, 1.0)
"""Factors on the widths of the priors of all effects."""
CALLED_FOR = 10.0
"""Log evidence that all effects must gain over the named ones: in 15 null sessions it was -12 at most."""
