"""From a sample of the state to a setpoint: reference, control tick, supervisor, the stream."""
