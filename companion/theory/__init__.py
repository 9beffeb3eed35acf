"""Bounds and margins of the control laws: what can be said before flying."""
