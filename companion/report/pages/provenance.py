"""Where what a page shows comes from."""

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Provenance:
    """Of one page."""

    command: str
    """That makes it again."""
    version: str
    commit: str = ""
    """Of the checkout; empty for an installed program."""
