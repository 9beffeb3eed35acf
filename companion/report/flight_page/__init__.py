"""`report.html` of a flight: did it track, and if not why; its figures, phases and messages."""
