"""Priors and thresholds of a diagnosis, each with its origin, and how far robot and markers may be off.

*Development*: fitted to synthetic sessions of development, see docs/benchmarks.md. *Convention*: a usual level.

`placement_uncertainty` finds the errors of boxes and markers in a session, within their priors; `perturbed_robots`
gives the twins of robots that are still as described.
"""

import numpy as np
from scipy.optimize import minimize

from fitting.features import marker_part
from fitting.session_model import NuisanceModel, PlacementUncertainty
from fitting.structure import ParameterUncertainty, PerturbedTwin, Source, assumed, perturbed_twins
from swimcal.robot import RobotSpec
from swimcal.twin import Twin

# Verdict
ALARM = 0.98
"""Least probability of a gap for an alarm. Development; docs/benchmarks.md has how often null sessions reach it."""
ENOUGH = 0.9
"""Least probability, given a gap, that one of the named effects, or a look-alike, is present. Convention."""
BESIDE = 0.6
"""Least such probability of further names, if no group of alternatives has ENOUGH; refits decide then. Development."""
HELD = 0.5
"""Least probability that one of the effects themselves is present for a name: more likely than not."""
NEAR_THRESHOLD = 0.005
"""Distance of a probability from a threshold that is told: three times what another machine or thread changes."""
MOST_ALIKE = 3
"""Largest number of alternatives in a group; the public contract."""
LOOKED_AT = 10
"""Number of the most probable effects that a group is chosen from: all sets of three of more would take long."""
MOST_LEFT = 0.5
"""Unexplained share of a gap above which names are withdrawn if an unknown effect is more probable. Development."""
MOST_LEFT_OF_CHANGE = 0.67
"""The same of a change since a reference, whatever else is probable: on real water launches leave half. Development."""
IN_CREEPS = 25.0
"""Squares of slides aside that an effect takes away where it surely shows in them: five standard deviations.

Convention.
"""
ADEQUATE = 0.01
"""Least probability that noise leaves as much as the best set of effects; below it nothing is named. Convention."""
FORM_ERROR = 0.15
"""Share of what effects explain by which their form may differ from the true one. Prototype."""
CLEAR_CHANGE = 5.0
"""Distance, in standard deviations, from which a change is told as visible: there effects are usually named."""
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
PLACED = 0.5
"""Probability from which a place is reported: more likely than not."""
USUAL_ERROR = 0.7
"""Least size of the twin's own error, relative to most sessions, beside which an unknown effect is weighed.

Beside a smaller one it would be that error: with it, a false name was sure. Development.
"""
SCALES = {0.3: 0.1, USUAL_ERROR: 0.27, 1.0: 0.4, 1.4: 0.16, 2.0: 0.07}
"""Prior probabilities of that size.

As in base sessions of the benchmark, with larger and smaller ones taken to be somewhat likelier than there. What all
trials share of the error has its usual size: with a smaller share a healthy second simulator was told to drag. With a
tenth of the error as a size, healthy swims of plain MuJoCo that had not settled had a name (blind test). Development.
"""
LAUNCHES = {
    (0.0, 0.0): 0.4,
    (0.3, 0.3): 0.2,
    (1.0, 0.3): 0.1,
    (1.0, 1.0): 0.15,
    (4.0, 0.3): 0.05,
    (4.0, 4.0): 0.1,
}
"""Prior probabilities of how much the course differs between launches, and slides, against `COURSE_OF_LAUNCH`.

None in the second simulator; simulated wakes differ by 6 to 50 mrad/s, launches of the real robot by 40 to 70. Markers
slide where the camera is tilted, which is little where a fish only goes another way; without any slide, a drifting
tracker of a slightly other form than the catalogue's is taken for a marker off its place. Development.
"""
UNLIKELY = 1e-4
"""Weight of such a size, against the likeliest, below which not all sets of effects are tried with it. Convention."""
WITHIN = {"hinge_stiffness": 0.02, "hinge_damping": 0.05, "crank_arm": 0.005, "mass": 0.02}
"""Relative standard deviation of each number of a robot about its description, as dry experiments determine it."""
WIDER = 5.0
"""Factor on the width of a parameter's prior in a refit, so that the data decide."""
MOST_EFFECTS = 3
"""Largest number of effects in one hypothesis."""
MOST_GROUPS = 5
"""Largest number of groups of alternatives that act together."""
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
CREEP_SD_M_S = 3e-5
"""Standard deviation of the speed at which each marker slides aside of its neighbours, where nothing is wrong."""
NEAR = 0.3
"""Length scale of the discrepancy's correlation, in the logarithm of two swims' frequencies."""

# A reference session: what both sessions share, and what differs from launch to launch
SHARED_SD = 5.0
"""Width of what both sessions share of every effect, in prior standard deviations. Prototype: 1 raises false alarms."""
SAME_COMMAND = 0.01
"""Largest difference of the logarithms of two frequencies at one command. Convention."""
SAME_COMMAND_SHARE = 0.9
"""Share of the twin's own discrepancy in single swims that comes again in another swim at the same command.

What differs from launch to launch has sizes of its own. In three healthy pairs of the wake 0.9 is likelier than none by
60 to 80 units of log evidence. Development.
"""
SAME_COMMAND_ERROR_M = 3e-4
"""Size of an error of no particular cause that comes again in every swim at one command, m.

Without it what one marker does in the reference is taken for noise where no effect explains it, and a healthy pair has
something at that marker. Development.
"""
USUAL_BETWEEN_LAUNCHES = 0.05
"""Standard deviation of an effect's parameters from launch to launch, in those of its prior. Prototype."""
BETWEEN_LAUNCHES = {"bend_offset": 0.5, "motor_start_delay": 0.4, "lens_distortion": 0.3, "camera_parallax": 0.15}
"""The same of effects that differ more: the trim of the tail at rest (15 mrad), and when a film begins (20 ms); what a
tilted camera shows is like a lens or heights that differ with the place in the picture. Development."""
TRIM = "bend_offset"
"""Name of the effect by which the trim of the tail at rest differs."""
COURSE_OF_LAUNCH = (0.004, 0.015)
"""Standard deviations of the speed sideways, m/s, and of the rate of turning, rad/s, from launch to launch."""
SLIDE_OF_LAUNCH_PER_S = 1e-3
"""Standard deviation of a marker's slide along the fish over its place: a camera tilted by 20 mrad, at 0.1 m/s."""
TILT_PER_M = 0.02
"""Standard deviation of a camera's tilt over its height, 1/m: by 40 mrad at 2 m. Both sessions share it."""
CREEP_OF_LAUNCH = (7e-5, 0.01)
"""Standard deviations of a marker's slide aside from launch to launch: its own, m/s, and over its height over nose and
neck, 1/s, as hulls roll and cameras are tilted. In the public trials, whose launches differ by four times the usual,
tail markers slide by 0.1 to 0.6 mm/s, the dorsal one, 50 mm higher, by 0.1 to 2.4; in the second simulator none does.
"""
ERROR_SIZES = {0.7: 0.3, 1.0: 0.35, 2.0: 0.2, 4.0: 0.1, 8.0: 0.05}
"""Prior probabilities of the size of the twin's own discrepancy beside a reference."""
SMOOTH_SIZES_M = {0.0: 0.4, 0.001: 0.2, 0.003: 0.2, 0.01: 0.2}
"""Prior probabilities of the size of the smooth error that both sessions share, m."""
LAUNCH_SIZES = {0.25: 0.1, 0.5: 0.15, 1.0: 0.35, 2.0: 0.25, 4.0: 0.15}
"""Prior probabilities of the size of what differs between launches, against the usual."""
WIDER_IN_CHANGED = {1.0: 0.4, 1.4: 0.35, 1.9: 0.25}
"""Prior probabilities of a factor on the standard deviation of all that a reference does not foretell.

Launches of the real robot at other commands have twice the squares that three swims of a reference let expect.
"""
STRONGEST_CHANGE_SD = 8.0
"""Largest change, in prior standard deviations of an effect: else two strong ones may cancel."""
ONE_CHANGE = (0.5, 0.5)
"""Prior probabilities of no change and of one: who compares with a reference changes one thing."""
LIKE_A_CHANGE = 0.05
"""Odds that a change with something else besides only looks like its effect: its form may differ. Development."""
FORM_ERROR_OF_CHANGE = (0.1, 0.2)
"""Shares of its norm that the form of a change may miss, without a limit. Development."""

# A gap of no particular cause, for one metre of displacement
SPEED_PER_M = 1.0
"""Difference of the forward speed, m/s."""
COURSE_PER_M = (1.0, 6.0)
"""Differences of the speed sideways, m/s, and of the rate of turning, rad/s."""
SLIDE_PER_M = 0.1
"""Difference of a marker's speed along the fish, m/s, as if it slid as far in 10 s."""
CREEP_PER_M = 0.1
"""Difference of a marker's speed aside of its neighbours, m/s, as that along the fish."""
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

# Errors of boxes and markers, and of masses
TAKEN = PlacementUncertainty(box_m=0.003, marker_m=0.001)
"""Prior errors: boxes are off by a few pixels, markers by as much as a ruler allows."""

_LN_SD = 0.7  # prior standard deviation of the logarithm of either size
_ENDS_M = (1e-4, 0.05)  # ends of the search for either size
_STARTS = ((1.0, 1.0), (3.0, 1.0), (1.0, 10.0))  # starts of the search, relative to the prior's centre
_STEP = 0.05  # relative step of a mass, either way


def placement_uncertainty(
    residual: np.ndarray, trials: int, disturbances: NuisanceModel, observed: np.ndarray | None = None
) -> PlacementUncertainty:
    """Return the likeliest sizes of the errors of boxes and markers.

    Args:
        residual: (k,) residual of the features.
        trials: number of trials that they are of.
        disturbances: what noise and nuisances do to them.
        observed: (k,) features that are measured; default all.
    """
    means = mean_places(len(residual), trials)
    means = means if observed is None else means[observed[means]]
    off, fixed = residual[means], disturbances.fixed[np.ix_(means, means)]
    boxes, markers = (part @ part.T for part in (disturbances.per_box[means], disturbances.per_marker[means]))
    taken = np.log(TAKEN)

    def deviance(ln_sd: np.ndarray) -> float:
        covariance = fixed + np.exp(2 * ln_sd[0]) * boxes + np.exp(2 * ln_sd[1]) * markers
        prior = (((ln_sd - taken) / _LN_SD) ** 2).sum()
        return float(off @ np.linalg.solve(covariance, off) + np.linalg.slogdet(covariance)[1] + prior)

    ends = [tuple(np.log(_ENDS_M))] * 2
    found = [
        minimize(deviance, taken + np.log(start), method="L-BFGS-B", bounds=ends, options={"ftol": 1e-7})
        for start in _STARTS
    ]
    return PlacementUncertainty(*map(float, np.exp(min(found, key=lambda each: float(each.fun)).x)))


def mean_places(length: int, trials: int) -> np.ndarray:
    """Return where a row of features holds the means of its markers, (2 m t,).

    Args:
        length: number of features in the row, k.
        trials: number of trials, t.
    """
    return marker_part(np.arange(length).reshape(trials, -1))[..., 0].ravel()


def perturbed_robots(twin: Twin) -> tuple[PerturbedTwin, ...]:
    """Return twins on either side of the description, for all that a robot may differ by and still be as described."""
    sources = [source for source in assumed(twin.robot).sources if source.value > 0]
    doubted = perturbed_twins(twin, [ParameterUncertainty(source, WITHIN[source.quantity]) for source in sources])
    kg = sum(part.mass_kg for part in twin.robot.head.part)
    mass = ParameterUncertainty(Source("mass", kg, "kg", None, (), "as described"), WITHIN["mass"])
    for heavier in (_with_head_mass_times, RobotSpec.with_tail_mass_times):
        more, less = (twin.of_robot(heavier(twin.robot, 1 + by)) for by in (_STEP, -_STEP))
        doubted = (*doubted, PerturbedTwin(mass, more, less, _STEP))
    return doubted


def _with_head_mass_times(robot: RobotSpec, factor: float) -> RobotSpec:
    parts = tuple(part.model_copy(update={"mass_kg": part.mass_kg * factor}) for part in robot.head.part)
    return robot.changed(head={"part": parts})
