"""Flies a multirotor along a trajectory with MPC and L1 adaptive control, over MAVLink."""
