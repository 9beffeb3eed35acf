"""Ways for bytes to reach an autopilot or a client: UDP, TCP, serial, memory."""
