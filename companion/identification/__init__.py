"""From the recording of an identification flight to a vehicle's figures, and on to its files."""
