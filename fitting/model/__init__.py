"""One hierarchical model of swim trials, y_i = g(theta; f_i) + B_i b_i + delta_i + e_i: fit, posterior and forecasts.

theta: the five coefficients, common to all trials. b_i: nuisances that differ from trial to trial (start, boxes,
registration of the head frame, trim). delta_i: model discrepancy, a Gaussian process over frequency with a part common
to all trials and one of each trial. e_i: tracking noise. All but theta enter linearly, so they join one covariance.
"""

from fitting.model.mode import Mode, mode_at
from fitting.model.search import find_mode
from fitting.model.session_model import SessionModel
from fitting.model.variance import COMPONENTS, Block, Covariance

__all__ = ["COMPONENTS", "Block", "Covariance", "Mode", "SessionModel", "find_mode", "mode_at"]
