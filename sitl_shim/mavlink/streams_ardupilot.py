"""What ArduCopter 4.7-dev streams: nothing but HEARTBEAT and TIMESYNC, until it is asked.

SET_MESSAGE_INTERVAL asks for single messages, REQUEST_DATA_STREAM for groups of them.
"""

from collections.abc import Mapping

from sitl_shim.autopilot.interface import Announcement
from sitl_shim.mavlink import messages_ardupilot as ardupilot
from sitl_shim.mavlink import messages_motion as motion
from sitl_shim.mavlink import messages_status as status
from sitl_shim.mavlink.streams import HEARTBEAT_ID, TIMESYNC_ID, Builder, timesync
from sitl_shim.mavlink.wire import dialect

BUILDERS: dict[int, Builder] = {
    HEARTBEAT_ID: status.heartbeat,
    dialect.MAVLINK_MSG_ID_LOCAL_POSITION_NED: ardupilot.local_position_ned,
    dialect.MAVLINK_MSG_ID_ATTITUDE_QUATERNION: motion.attitude_quaternion,
    dialect.MAVLINK_MSG_ID_ATTITUDE: motion.attitude,
    dialect.MAVLINK_MSG_ID_ATTITUDE_TARGET: motion.attitude_target,
    dialect.MAVLINK_MSG_ID_GLOBAL_POSITION_INT: motion.global_position_int,
    dialect.MAVLINK_MSG_ID_HIGHRES_IMU: ardupilot.highres_imu,
    dialect.MAVLINK_MSG_ID_RAW_IMU: ardupilot.raw_imu,
    TIMESYNC_ID: timesync,
    dialect.MAVLINK_MSG_ID_POSITION_TARGET_LOCAL_NED: motion.position_target_local_ned,
    dialect.MAVLINK_MSG_ID_SERVO_OUTPUT_RAW: ardupilot.servo_output_raw,
    dialect.MAVLINK_MSG_ID_VFR_HUD: ardupilot.vfr_hud,
    dialect.MAVLINK_MSG_ID_GPS_RAW_INT: ardupilot.gps_raw_int,
    dialect.MAVLINK_MSG_ID_SYS_STATUS: ardupilot.sys_status,
    dialect.MAVLINK_MSG_ID_EKF_STATUS_REPORT: ardupilot.ekf_status_report,
    dialect.MAVLINK_MSG_ID_EXTENDED_SYS_STATE: ardupilot.extended_sys_state,
    dialect.MAVLINK_MSG_ID_SYSTEM_TIME: status.system_time,
    dialect.MAVLINK_MSG_ID_BATTERY_STATUS: status.battery_status,
    dialect.MAVLINK_MSG_ID_HOME_POSITION: ardupilot.home_position,
    dialect.MAVLINK_MSG_ID_GPS_GLOBAL_ORIGIN: ardupilot.gps_global_origin,
    dialect.MAVLINK_MSG_ID_VIBRATION: status.vibration,
    dialect.MAVLINK_MSG_ID_CURRENT_MODE: status.current_mode,
    dialect.MAVLINK_MSG_ID_MISSION_CURRENT: ardupilot.mission_current,
    dialect.MAVLINK_MSG_ID_SIMSTATE: ardupilot.simstate,
    dialect.MAVLINK_MSG_ID_SIM_STATE: ardupilot.sim_state,
}
"""Messages that can be streamed, in the order in which they leave."""

REQUESTABLE: dict[int, Builder] = BUILDERS | {
    dialect.MAVLINK_MSG_ID_AUTOPILOT_VERSION: ardupilot.autopilot_version,
    dialect.MAVLINK_MSG_ID_AVAILABLE_MODES_MONITOR: status.available_modes_monitor,
}
"""Messages that REQUEST_MESSAGE brings; AVAILABLE_MODES, which takes an index, besides."""

RATES_HZ: dict[int, float] = {HEARTBEAT_ID: 1.0, TIMESYNC_ID: 0.1}
"""What every link starts with."""

ANNOUNCEMENTS: dict[Announcement, Builder] = {
    Announcement.HEARTBEAT: status.heartbeat,
    Announcement.ORIGIN: ardupilot.gps_global_origin,
    Announcement.HOME: ardupilot.home_position,
}
"""What it sends on all links when something changes."""

LEGACY_GROUPS: Mapping[int, tuple[int, ...]] = {
    1: (dialect.MAVLINK_MSG_ID_RAW_IMU,),
    2: (
        dialect.MAVLINK_MSG_ID_SYS_STATUS,
        dialect.MAVLINK_MSG_ID_GPS_RAW_INT,
        dialect.MAVLINK_MSG_ID_MISSION_CURRENT,
    ),
    3: (dialect.MAVLINK_MSG_ID_SERVO_OUTPUT_RAW,),
    6: (
        dialect.MAVLINK_MSG_ID_GLOBAL_POSITION_INT,
        dialect.MAVLINK_MSG_ID_LOCAL_POSITION_NED,
    ),
    10: (dialect.MAVLINK_MSG_ID_ATTITUDE, dialect.MAVLINK_MSG_ID_SIMSTATE),
    11: (dialect.MAVLINK_MSG_ID_VFR_HUD,),
    12: (
        dialect.MAVLINK_MSG_ID_SYSTEM_TIME,
        dialect.MAVLINK_MSG_ID_BATTERY_STATUS,
        dialect.MAVLINK_MSG_ID_EKF_STATUS_REPORT,
        dialect.MAVLINK_MSG_ID_VIBRATION,
    ),
}
"""What REQUEST_DATA_STREAM asks for, by MAV_DATA_STREAM; 0 is all of them."""
