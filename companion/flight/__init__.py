"""A flight: phases, control loop, supervisor, clock, and the one inbox for a person's commands."""
