"""Endurance: flights for hours, and what grows in them (docs/endurance.md)."""
