"""How the rerun viewer arranges a flight's recording."""

import math
from typing import Any

from companion.export.scene import Scene


def views(rrb: Any, scene: Scene, timeline: str) -> Any:  # noqa: ANN401 - rerun has no types
    """The views that there are at first: scene and messages at the left, figures at the right.

    Args:
        rrb: the module `rerun.blueprint`.
        scene: what the eye looks at.
        timeline: along which the recording is shown.
    """
    return rrb.Blueprint(
        rrb.Horizontal(
            rrb.Vertical(
                rrb.Spatial3DView(
                    origin="world", name="Flight, ENU [m]", eye_controls=_eye(rrb, scene)
                ),
                rrb.TextLogView(origin="messages", name="Messages"),
                row_shares=[4, 1],
            ),
            rrb.Vertical(
                rrb.TimeSeriesView(origin="plots/error_mm", name="Tracking error [mm]"),
                rrb.TimeSeriesView(origin="plots/position", name="Position and desired [m]"),
                rrb.Tabs(
                    rrb.TimeSeriesView(origin="plots/tilt_deg", name="Tilt [degrees]"),
                    rrb.TimeSeriesView(origin="plots/thrust", name="Thrust"),
                    rrb.TimeSeriesView(origin="plots/velocity", name="Velocity [m/s]"),
                ),
                rrb.Tabs(
                    rrb.TimeSeriesView(origin="plots/y_tilde", name="Prediction error [m/s]"),
                    rrb.TimeSeriesView(origin="plots/sigma", name="Adaptive estimate"),
                    rrb.TimeSeriesView(origin="plots/computed_us", name="Computing [µs]"),
                ),
            ),
        ),
        rrb.TimePanel(timeline=timeline, state="collapsed"),
        collapse_panels=True,
    )


def _eye(rrb: Any, scene: Scene) -> Any:  # noqa: ANN401 - rerun
    """From the south-east, above, as far away as the desired path is large."""
    points = scene.desired_enu_m or scene.flown_enu_m or [(0.0, 0.0, 0.0)]
    low = [min(point[k] for point in points) for k in range(3)]
    high = [max(point[k] for point in points) for k in range(3)]
    middle = [(a + b) / 2.0 for a, b in zip(low, high, strict=True)]
    away_m = 0.9 * max(math.dist(low, high), 1.0)
    position = [middle[0] + 0.5 * away_m, middle[1] - away_m, middle[2] + 0.6 * away_m]
    return rrb.EyeControls3D(position=position, look_target=middle)
