"""What differs between autopilots: one module for each, all of the shape of `AutopilotDialect`."""
