"""The vehicle as physics: rigid body, rotors, drag, ground and battery."""
