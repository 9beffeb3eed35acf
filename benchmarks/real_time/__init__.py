"""Real time seen from outside: a relay between vehicle and client, and what runs beside it."""
