"""The stages of a flight, from connecting to landing, and who flies meanwhile."""
