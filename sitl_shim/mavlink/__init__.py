"""The MAVLink side of the shim, without I/O: bytes in, bytes out."""
