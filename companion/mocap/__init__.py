"""Motion capture: poses of the vehicle from outside, handed to the autopilot's estimator."""
