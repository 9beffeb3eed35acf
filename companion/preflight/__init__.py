"""What is found before a flight, and what it means: pure judgements of what was gathered."""
