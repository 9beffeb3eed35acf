"""Local positions as latitude and longitude: a plane tangent to the Earth at the origin."""

import math

from sitl_shim.frames import Vector3
from sitl_shim.simulation import GlobalOrigin

_EARTH_RADIUS_M = 6_371_000.0


def global_position(origin: GlobalOrigin, position_enu_m: Vector3) -> tuple[int, int, int]:
    """Latitude and longitude in 1e-7 degrees (1.1 cm steps), altitude above sea level in mm."""
    east, north, up = position_enu_m
    latitude = origin.latitude_deg + math.degrees(north / _EARTH_RADIUS_M)
    parallel_m = _EARTH_RADIUS_M * math.cos(math.radians(origin.latitude_deg))
    longitude = origin.longitude_deg + math.degrees(east / parallel_m)
    return (
        round(latitude * 1e7),
        round(longitude * 1e7),
        round((origin.altitude_amsl_m + up) * 1000.0),
    )
