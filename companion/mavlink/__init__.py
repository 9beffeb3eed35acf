"""MAVLink without input or output: bytes and times in, bytes and verdicts out."""
