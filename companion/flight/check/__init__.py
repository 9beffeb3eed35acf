"""What is looked over before a flight, and what is set for it and set back."""
