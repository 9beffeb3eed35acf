"""Campaigns: many flights planned by a YAML file, flown here or on a cluster, kept as they come."""
