"""Desired trajectories: position with its derivatives, as pure functions of time."""
