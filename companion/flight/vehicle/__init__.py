"""The vehicle at the other end of the link: what it says, what is asked of it, what it answers."""
