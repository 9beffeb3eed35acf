"""A flight on a page in the browser: while it flies, or afterwards from its log.

The flight itself only hands over what it records (`feed`); all else is a process of its own
(`companion.live.__main__`): what it means (`frames`, `scene`, `watching`), and who sees it
(`server`, `access`).
"""
