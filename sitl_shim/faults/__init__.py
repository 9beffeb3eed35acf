"""What goes wrong on purpose: what a link does to packets, and what befalls the vehicle."""
