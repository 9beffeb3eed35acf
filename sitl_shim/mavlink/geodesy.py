"""Local positions as latitude and longitude: a plane tangent to the Earth at the origin."""

import math

from sitl_shim.frames import Vector3
from sitl_shim.mavlink.integers import int32
from sitl_shim.simulation import GlobalOrigin

_EARTH_RADIUS_M = 6_371_000.0


def global_position(origin: GlobalOrigin, position_enu_m: Vector3) -> tuple[int, int, int]:
    """Latitude and longitude in 1e-7 degrees (1.1 cm steps), altitude above sea level in mm."""
    east, north, up = position_enu_m
    latitude = origin.latitude_deg + math.degrees(north / _EARTH_RADIUS_M)
    parallel_m = _EARTH_RADIUS_M * math.cos(math.radians(origin.latitude_deg))
    longitude = origin.longitude_deg + math.degrees(east / parallel_m)
    return (
        int32(latitude * 1e7),
        int32(longitude * 1e7),
        int32((origin.altitude_amsl_m + up) * 1000.0),
    )


def local_position(
    origin: GlobalOrigin, latitude_deg: float, longitude_deg: float
) -> tuple[float, float]:
    """East and north (m) of a latitude and a longitude: the inverse of `global_position`."""
    parallel_m = _EARTH_RADIUS_M * math.cos(math.radians(origin.latitude_deg))
    turn_deg = math.remainder(longitude_deg - origin.longitude_deg, 360.0)
    return (
        math.radians(turn_deg) * parallel_m,
        math.radians(latitude_deg - origin.latitude_deg) * _EARTH_RADIUS_M,
    )
