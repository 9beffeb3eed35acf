"""Ways for bytes to reach an autopilot: one interface over UDP or memory."""
