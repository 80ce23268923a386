"""All effects that are known: the built-in ones, and whatever users have added through the entry point group."""

from collections.abc import Mapping
from functools import lru_cache
from importlib.metadata import entry_points
from types import MappingProxyType

from swimmer.effects import drive, floating, fluid, measurement, structure, tendons
from swimmer.effects.added import GROUP, added_effects
from swimmer.effects.effect import Effect

FAMILIES = (measurement, drive, tendons, structure, fluid, floating)


@lru_cache(maxsize=1)
def catalogue() -> Mapping[str, Effect]:
    """Every effect by its name, built-in ones first.

    Raises:
        InputError: what is wrong with effects of users, all of it at once.
    """
    found = {effect.name: effect for family in FAMILIES for effect in family.EFFECTS}
    return MappingProxyType(found | added_effects(entry_points(group=GROUP), found))
