"""A quadrotor, its wind and its autopilot, in software, seen over MAVLink alone."""
