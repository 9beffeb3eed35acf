"""Units of the keys of YAML files: by the end of a key's name, or said where the name has none."""

from typing import Any

UNIT_KEY = "x-unit"
"""Of a field's `json_schema_extra`: its unit, where its name does not say it."""
TYPE_KEY = "x-type"
"""Of a field's `json_schema_extra`: what is written there, in words, where the annotation does not
say it."""

_UNITS = {
    "m_s2_sqrt_hz": "m/s² per √Hz",
    "n_s2_m2": "N s²/m²",
    "bytes_s": "bytes/s",
    "packets_s": "packets/s",
    "n_m_s": "N m s",
    "n_s_m": "N s/m",
    "kg_m2": "kg m²",
    "rad_s": "rad/s",
    "deg_s": "°/s",
    "m_s2": "m/s²",
    "m_s": "m/s",
    "g_s": "g/s",
    "a_h": "A h",
    "1_s": "1/s",
    "1_m": "1/m",
    "bytes": "bytes",
    "rad": "rad",
    "deg": "°",
    "ohm": "Ω",
    "hz": "Hz",
    "kg": "kg",
    "mm": "mm",
    "s": "s",
    "m": "m",
    "n": "N",
    "v": "V",
    "w": "W",
}
"""By the words at the end of a name; longer ones come first."""


def unit(text: str) -> dict[str, Any]:
    """What a field's `json_schema_extra` says of its unit."""
    return {UNIT_KEY: text}


def written(text: str) -> dict[str, Any]:
    """What a field's `json_schema_extra` says of how it is written, in words."""
    return {TYPE_KEY: text}


def unit_of(name: str) -> str:
    """The unit that a key's name ends in; empty where it ends in none.

    >>> unit_of("acceleration_limit_m_s2"), unit_of("hover_s"), unit_of("horizon"), unit_of("m")
    ('m/s²', 's', '', '')
    """
    return next((unit for words, unit in _UNITS.items() if name.endswith(f"_{words}")), "")
