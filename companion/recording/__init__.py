"""The flight log: every packet as a tlog, every controller record as MCAP."""
