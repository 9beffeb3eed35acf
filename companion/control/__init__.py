"""Pure control laws: arrays in, arrays out.  No I/O, no clock, no global state."""
