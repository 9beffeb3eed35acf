"""The paper's experiments and the tuning of controllers, flown in lockstep."""
