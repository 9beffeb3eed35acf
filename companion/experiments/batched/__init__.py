"""Thousands of simplified vehicles at once, under the laws that fly; docs/batched-study.md."""
