"""A flight as a recording for the rerun viewer (https://rerun.io): ``rerun flight.rrd``."""

import math
import uuid
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from companion.export.errors import MissingExtraError
from companion.export.rerun_views import views
from companion.export.scene import Scene, point_of, scene_of, tilt_deg
from companion.export.source import Tell
from companion.extras import install_extra
from companion.mavlink.framing import Framer
from companion.mavlink.messages import MessageId
from companion.mavlink.telemetry import Rejected, state_from_odometry
from companion.recording.flight_files import FlightFiles
from companion.report.flight_data import is_truth_packet

FLIGHT_TIME = "flight_time"
"""Since the log's time 0.  rerun has a timeline `log_time` of its own, of when it was told."""
AUTOPILOT_TIME = "autopilot_time"
_BATCH = 2048
_AXES = "xyz"
_GONE = (math.nan,) * 3
_ARM_M = 0.18
_LINE_M = 0.006
_DESIRED, _FLOWN, _TRUE = (242, 158, 26), (64, 143, 245), (120, 200, 120)
_FENCE, _VEHICLE, _FORWARD = (150, 150, 150), (230, 230, 230), (235, 77, 61)
_OF_AXES = ((235, 77, 61), (90, 180, 80), (64, 143, 245))
_PLAIN = ("thrust", "computed_us", "latency_s", "loop_delay_s", "state_age_s")
"""Fields of a control record that are shown as they are."""
_BY_AXIS = (
    "position_enu_m",
    "desired_enu_m",
    "velocity_enu_m_s",
    "y_tilde_m_s",
    "y_tilde_bound_m_s",
    "sigma_hat",
    "sigma_bound",
    "applied_u",
)
"""The same of vectors."""
_LEVELS = {"info": "INFO", "warning": "WARN", "error": "ERROR"}


def write_rerun(files: FlightFiles, path: Path, tell: Tell) -> None:
    """Write the recording.

    Raises:
        FlightFilesError: the log cannot be read.
        MissingExtraError: rerun is not installed.
        OSError: the file cannot be written.
    """
    rr = _rerun()
    scene = scene_of(files, tell)
    path.open("wb").close()  # else rerun only warns of a file that it cannot write
    name = files.folder.resolve()
    recording = rr.RecordingStream(
        "companion", recording_id=uuid.uuid5(uuid.NAMESPACE_URL, name.as_uri())
    )
    recording.set_log_time_enabled(False)
    recording.set_log_tick_enabled(False)
    recording.save(path, default_blueprint=views(rr.blueprint, scene, FLIGHT_TIME))
    recording.send_recording_name(name.name)
    _send_still(rr, recording, scene)
    _send_records(rr, recording, files, scene, tell)
    _send_truth(rr, recording, files, tell)
    recording.flush()
    recording.disconnect()


def _send_still(rr: Any, recording: Any, scene: Scene) -> None:  # noqa: ANN401 - rerun
    """What stands still, and what moves with the vehicle as it is."""
    recording.log("world", rr.ViewCoordinates.RIGHT_HAND_Z_UP, static=True)
    for name, points, color in (
        ("world/desired_path", scene.desired_enu_m, _DESIRED),
        ("world/flown_path", scene.flown_enu_m, _FLOWN),
    ):
        if points:
            recording.log(
                name, rr.LineStrips3D([points], colors=[color], radii=[_LINE_M]), static=True
            )
    if scene.geofence_enu_m is not None:
        low, high = scene.geofence_enu_m
        sizes = [b - a for a, b in zip(low, high, strict=True)]
        recording.log(
            "world/geofence",
            rr.Boxes3D(
                mins=[low],
                sizes=[sizes],
                colors=[_FENCE],
                fill_mode=rr.components.FillMode.MajorWireframe,
            ),
            static=True,
        )
    side = _ARM_M / math.sqrt(2.0)
    arms = [[(side, side, 0), (-side, -side, 0)], [(side, -side, 0), (-side, side, 0)]]
    recording.log(
        "world/vehicle/arms",
        rr.LineStrips3D(arms, colors=[_VEHICLE], radii=[0.012]),
        static=True,
    )
    recording.log(
        "world/vehicle/forward",
        rr.Arrows3D(vectors=[(1.4 * _ARM_M, 0, 0)], colors=[_FORWARD], radii=[0.01]),
        static=True,
    )
    for field in _BY_AXIS:
        for axis, color in zip(_AXES, _OF_AXES, strict=True):
            shade = (
                tuple(c // 2 for c in color) if "bound" in field or "desired" in field else color
            )
            recording.log(
                _entity(field, axis),
                rr.SeriesLines(colors=[shade], names=[f"{field} {axis}"]),
                static=True,
            )
    for field in (*_PLAIN, "error_mm", "tilt_deg"):
        recording.log(f"plots/{field}", rr.SeriesLines(names=[field]), static=True)


def _entity(field: str, axis: str) -> str:
    """Where a figure is: what belongs together is in one folder, for one plot."""
    stem = field.removesuffix("_m_s").removesuffix("_enu_m").removesuffix("_enu")
    if stem.endswith("_bound"):
        return f"plots/{stem.removesuffix('_bound')}/bound/{axis}"
    folder = {"desired": "position", "sigma_hat": "sigma"}.get(stem, stem)
    return f"plots/{folder}/{stem}/{axis}"


def _send_records(
    rr: Any,  # noqa: ANN401 - rerun
    recording: Any,  # noqa: ANN401 - rerun
    files: FlightFiles,
    scene: Scene,
    tell: Tell,
) -> None:
    waiting: list[tuple[float, dict[str, Any]]] = []
    for count, record in enumerate(files.records()):
        if record.topic == "control":
            waiting.append((record.time_s, record.values))
            if len(waiting) >= _BATCH:
                _send_control(rr, recording, waiting)
                waiting.clear()
                tell("records", count, scene.records)
        elif record.topic == "event":
            values = record.values
            recording.set_time(FLIGHT_TIME, duration=record.time_s)
            level = _LEVELS.get(values.get("severity", ""), "INFO")
            recording.log("messages", rr.TextLog(values.get("text", ""), level=level))
    recording.reset_time()
    _send_control(rr, recording, waiting)
    tell("records", scene.records, scene.records)


def _send_control(
    rr: Any,  # noqa: ANN401 - rerun
    recording: Any,  # noqa: ANN401 - rerun
    records: Sequence[tuple[float, dict[str, Any]]],
) -> None:
    """Figures and places of some control records; what is not known is left out."""
    for field in _PLAIN:
        rows = [(t, v, v[field]) for t, v in records if v.get(field) is not None]
        _send_scalars(rr, recording, f"plots/{field}", rows)
    for field in _BY_AXIS:
        known = [(t, v, p) for t, v in records if (p := point_of(v.get(field))) is not None]
        for k, axis in enumerate(_AXES):
            _send_scalars(rr, recording, _entity(field, axis), [(t, v, p[k]) for t, v, p in known])
    errors: list[tuple[float, dict[str, Any], float]] = []
    flown: list[tuple[float, dict[str, Any], Any]] = []
    for t, values in records:
        position, desired = point_of(values["position_enu_m"]), point_of(values["desired_enu_m"])
        if position is not None and None not in values["attitude_flu_to_enu"]:
            flown.append((t, values, position))
            if desired is not None:
                errors.append((t, values, 1e3 * math.dist(position, desired)))
    _send_scalars(rr, recording, "plots/error_mm", errors)
    tilts = [(t, v, tilt_deg(v["attitude_flu_to_enu"])) for t, v, _ in flown]
    _send_scalars(rr, recording, "plots/tilt_deg", tilts)
    if flown:
        turned = [(x, y, z, w) for w, x, y, z in (v["attitude_flu_to_enu"] for _, v, _ in flown)]
        recording.send_columns(
            "world/vehicle",
            _times(rr, flown),
            rr.Transform3D.columns(translation=[p for _, _, p in flown], quaternion=turned),
        )
    wanted = [(t, v, p) for t, v in records if (p := point_of(v["desired_enu_m"])) is not None]
    if wanted:
        recording.send_columns(
            "world/desired",
            _times(rr, wanted),
            rr.Points3D.columns(
                positions=[p for _, _, p in wanted],
                colors=[_DESIRED] * len(wanted),
                radii=[0.03] * len(wanted),
            ),
        )


def _send_scalars(
    rr: Any,  # noqa: ANN401 - rerun
    recording: Any,  # noqa: ANN401 - rerun
    entity: str,
    rows: Sequence[tuple[float, dict[str, Any], float]],
) -> None:
    if rows:
        recording.send_columns(
            entity, _times(rr, rows), rr.Scalars.columns(scalars=[value for *_, value in rows])
        )


def _times(rr: Any, rows: Sequence[tuple[float, dict[str, Any], Any]]) -> list[Any]:  # noqa: ANN401
    return [
        rr.TimeColumn(FLIGHT_TIME, duration=[t for t, *_ in rows]),
        rr.TimeColumn(AUTOPILOT_TIME, duration=[v["autopilot_time_s"] for _, v, _ in rows]),
    ]


def _send_truth(rr: Any, recording: Any, files: FlightFiles, tell: Tell) -> None:  # noqa: ANN401
    """Where the vehicle really was, in a simulation."""
    framer = Framer()
    times: list[float] = []
    clock: list[float] = []
    places: list[tuple[float, float, float]] = []

    def send() -> None:
        recording.send_columns(
            "world/true_position",
            [
                rr.TimeColumn(FLIGHT_TIME, duration=times),
                rr.TimeColumn(AUTOPILOT_TIME, duration=clock),
            ],
            rr.Points3D.columns(
                positions=places, colors=[_TRUE] * len(places), radii=[0.02] * len(places)
            ),
        )
        times.clear()
        clock.clear()
        places.clear()

    for count, record in enumerate(files.packets()):
        if count % 20_000 == 0:
            tell("packets", count, None)
        if record.sent or not is_truth_packet(record.raw):
            continue
        for frame in framer.feed(record.raw):
            if frame.message_id != MessageId.ODOMETRY:
                continue
            state = state_from_odometry(frame)
            if not isinstance(state, Rejected):
                times.append(files.log_time_s(record))
                clock.append(state.time_s)
                places.append(state.position_enu_m)
        if len(times) >= _BATCH:
            send()
    if times:
        send()


def _rerun() -> Any:  # noqa: ANN401 - an optional library
    try:
        import rerun
        import rerun.blueprint
    except ImportError as error:
        raise MissingExtraError(
            f"A recording for rerun needs its SDK: {install_extra('rerun')}"
        ) from error
    return rerun
