"""Writes docs/performance.md and its figures from what the benchmarks have kept."""
