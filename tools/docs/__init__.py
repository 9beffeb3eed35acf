"""Makes what the documentation's site is made of: pictures, architecture, YAML reference."""
