"""What the autopilot's estimator makes of the truth."""
