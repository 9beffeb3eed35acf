"""The figures of the study: each module draws one or two from the results, `registry` lists them.

A drawing is a function `draw(results) -> Figure`, a caption a function `caption(results) -> str`
that says what is shown, in which unit, from which seeds and scenario, and what to see.  Neither
reads or writes a file, but for the fans' places, which the drawing of the trajectories looks up.
"""
