"""Which markers an effect of single markers may concern: all but those that make the head frame."""

from swimmer.robot import RobotSpec

_HEAD = ("nose", "neck")


def others(markers: tuple[str, ...]) -> tuple[str, ...]:
    """All but nose and neck."""
    return tuple(name for name in markers if name not in _HEAD)


def on_tail(robot: RobotSpec, markers: tuple[str, ...]) -> tuple[str, ...]:
    """Those on the tail, from head to fin."""
    behind = [name for name in markers if robot.markers[name].body != "head"]
    return tuple(sorted(behind, key=lambda name: robot.markers[name].position_m[0]))
