"""What is large is packed as the largest there is; what was read is forgotten."""

from dataclasses import replace

import pytest

from sitl_shim.mavlink.streams import LinkKind
from sitl_shim.mavlink.wire import Packer, Parser, dialect
from sitl_shim.simulation import ShimOptions
from tests.sitl_shim.mavlink.shim_client import ShimClient


@pytest.mark.parametrize("autopilot", ["px4", "ardupilot"])
@pytest.mark.parametrize("far_m", [1e6, -1e6, 1e12, -1e12])
def test_an_estimate_far_away_is_sent_all_the_same(autopilot, far_m):
    client = ShimClient(
        ShimOptions(autopilot=autopilot, airborne_at_enu_m=(0.0, 0.0, 30.0), boot_scale=0.02),
        (LinkKind.ONBOARD, LinkKind.GROUND_STATION),
    )
    client.run(3.0)
    simulation = client.simulation
    sense = simulation.sense

    def sense_far_away():
        sense()
        far = (far_m, far_m, far_m)
        simulation.estimate = replace(simulation.estimate, position_enu_m=far, velocity_enu_m_s=far)

    simulation.sense = sense_far_away
    for message_id in (24, 27, 30, 32, 33, 74, 105, 141, 242, 331):
        client.set_interval(message_id, 100_000)
    client.run(2.0)

    told = client.last("GLOBAL_POSITION_INT")
    assert (told.vx, told.vz) == ((32767, -32768) if far_m > 0.0 else (-32768, 32767))
    if abs(far_m) > 1e9:
        assert told.alt == (2**31 - 1 if far_m > 0.0 else -(2**31))
    only_px4 = ("ALTITUDE", "ODOMETRY") if autopilot == "px4" else ()
    for name in ("GPS_RAW_INT", "HIGHRES_IMU", "VFR_HUD", *only_px4):
        assert client.messages(name)


def test_the_parser_keeps_little_though_no_chunk_ends_with_a_message():
    packer, parser = Packer(1, 191), Parser()
    frames = [packer.pack(dialect.MAVLink_ping_message(k, k, 0, 0)) for k in range(3000)]
    held, read = b"", 0
    for frame in frames:
        read += len(list(parser.parse(held + frame[:7])))
        held = frame[7:]

    assert read == len(frames) - 1
    assert len(parser._mavlink.buf) < 6000
