"""TinyMPC stub to be written."""
CONTENDERS = []
