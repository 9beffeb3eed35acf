"""What a flight looks like afterwards: figures of merit, tables, pictures; and live, a line."""
