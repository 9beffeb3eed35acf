"""Autopilots in software: what they share, and one package per flavour."""
