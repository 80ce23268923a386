"""What a search may minimise, as the reader meets it."""

from fitting import Comparison

OBJECTIVES: dict[Comparison, str] = {
    "published": "published objective: mean marker distance in the head frame",
    "shape": "shape-only objective: distance relative to the nose, so that a drift in heading does not hide the tail",
}
