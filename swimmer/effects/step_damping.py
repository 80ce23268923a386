"""Damping that changes from step to step."""

from typing import NamedTuple

import numpy as np


class StepDamping(NamedTuple):
    """What is added to the damping of n models for the next step, which the engine takes at the end of the step.

    So a force that is stiff in speed, as dry friction, does not limit the step: written as damping times speed it is
    taken at the new speed (Kacanov's linearisation). A force of an effect would be taken at the old one.

    Attributes:
        joints: (n, v) N s/m and N m s/rad, in the order of the joints.
        tendons: (n, 2) left and right, N s/m; 0 without tendons.
    """

    joints: np.ndarray | float = 0.0
    tendons: np.ndarray | float = 0.0
