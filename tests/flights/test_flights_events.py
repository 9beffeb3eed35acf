"""Sudden events in whole flights: they come while the trajectory is flown, and are survived."""

import pytest

from companion.mavlink.framing import Framer
from companion.mavlink.messages import COMPONENT_TRUTH, MessageId
from companion.recording.tlog import read_tlog
from companion.report.flight_data import read_flight
from companion.report.recovery import event_object
from tests.flights.bench import Bench

EVENTS = {
    "payload": "payload:\n  - {at_s: 0.0, mass_share: 0.15}\n"
    "  - {at_s: AT, since: setpoints, mass_share: 0.0}\n",
    "front": "winds:\n  - {kind: front, velocity_enu_m_s: [4.8, 3.6, 0.0], rise_s: 0.5, at_s: AT,"
    " since: setpoints}\n",
    "motor1": "motors:\n  - {at_s: AT, since: setpoints, rotor: 1, thrust_factor: 0.9}\n",
}
APPROACH_S = {"px4": 3.8, "ardupilot": 3.5}
"""And the hover of 0.2 s: from the first setpoints to the short trajectory's start."""


@pytest.fixture
def fly(tmp_path):
    def fly_once(autopilot, event, **wire):
        folder = tmp_path / f"{autopilot}-{len(list(tmp_path.iterdir()))}"
        folder.mkdir()
        text = EVENTS[event].replace("AT", str(APPROACH_S[autopilot] + 1.0))
        winds = "" if "winds" in text else "winds: []\n"
        (folder / "sudden.yaml").write_text(f"name: sudden\n{winds}{text}")
        bench = Bench(folder)
        for name, value in wire.items():
            setattr(bench.wire, name, value)
        # The bench adds the ending.
        options = {"wind": str(folder / "sudden"), "autopilot": autopilot}
        return bench.fly(options=options, airborne=False)

    return fly_once


@pytest.mark.parametrize("autopilot", ["px4", "ardupilot"])
@pytest.mark.parametrize("event", list(EVENTS))
def test_it_is_survived_and_recorded(fly, autopilot, event):
    flown = fly(autopilot, event)
    assert (flown.outcome.outcome, flown.outcome.completed) == ("landed", True)
    data = read_flight(flown.folder)
    (told,) = data.truth.events
    assert told.name == event
    found = event_object(data, flown.outcome.scored_s)
    assert 0.0 < found["at_s"] < 3.0
    assert found["peak_height_error_m"] < 0.15


def test_no_setpoint_depends_on_being_told(fly):
    def hide(packet):
        told = packet.message_id == MessageId.NAMED_VALUE_FLOAT
        return b"" if told and packet.component_id == COMPONENT_TRUTH else packet.raw

    seen, blind = fly("px4", "payload"), fly("px4", "payload", from_shim=hide)
    assert not read_flight(blind.folder).truth.events
    assert setpoints(blind) == setpoints(seen)


def setpoints(flown):
    return [
        frame.raw
        for record in read_tlog(flown.folder / "flight.tlog")
        if record.sent
        for frame in Framer().feed(record.raw)
        if frame.message_id == MessageId.SET_ATTITUDE_TARGET
    ]
