"""Materials of walls: names for their reflectance of a sensor's infra-red light.

Source: khepera-protocol.md 8.6, fitted by eye to the curves of the Khepera's manual (8.3); white reflects everything.

Derivation: a surface of the brightness c, 1 to 255, reflects the share b = 0.02 + 0.98 c/255, so that of a reflectance
b the brightness is c = 255 (b - 0.02)/0.98, at least 1, as 0 is floor.
"""

from __future__ import annotations

from typing import Any

from kiks.model.checks import check_choice

BLACK_REFLECTANCE = 0.02
"""Reflectance of the darkest surface, at brightness 0."""

REFLECTANCES = {
    "white": 1.0,
    "wood": 0.75,
    "copper": 0.65,
    "pink sponge": 0.35,
    "grey": 0.1,
    "black": BLACK_REFLECTANCE,
}
"""Materials and their reflectances."""


def brightness_of(material: Any) -> Any:
    """Return the brightness 1..255 of a material by its name; what is no text is returned as it is.

    Example:
        >>> brightness_of("wood"), brightness_of(120)
        (190, 120)
    """
    if not isinstance(material, str):
        return material
    rule = f"a number from 1 to 255 or one of {list(REFLECTANCES)}"
    check_choice("brightness", material, REFLECTANCES, rule, "1 is a black wall, 255 a white one.")
    share = (REFLECTANCES[material] - BLACK_REFLECTANCE) / (1.0 - BLACK_REFLECTANCE)
    return max(round(255 * share), 1)
