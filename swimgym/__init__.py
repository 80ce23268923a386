"""Environments, policies and shoals of the calibrated twin.

Where gymnasium is installed, importing this package registers `swimgym/Target-v0` and `swimgym/Circle-v0`:

    gymnasium.make("swimgym:swimgym/Target-v0", session="pool")
    gymnasium.make_vec("swimgym:swimgym/Target-v0", num_envs=256, vectorization_mode="vector_entry_point")

Policies and `calib aquarium` need no gymnasium, and a trained policy no torch.
"""

from importlib.util import find_spec

from swimgym.course import Circle, Course, Moment, Rules, Targets
from swimgym.swimmers import Fish, Swimmers, load_fish

__all__ = ["Circle", "Course", "Fish", "Moment", "Rules", "Swimmers", "Targets", "load_fish"]

ENVIRONMENTS = {"swimgym/Target-v0": "target", "swimgym/Circle-v0": "circle"}

if find_spec("gymnasium") is not None:
    import gymnasium

    for _name, _task in ENVIRONMENTS.items():
        gymnasium.register(
            _name,
            "swimgym.environments:SwimEnv",
            vector_entry_point="swimgym.environments:SwimVectorEnv",
            kwargs={"task": _task},
        )
