"""MAVSDK as the mission's backend, with a MAVSDK that does as the test wants."""

import asyncio
from enum import Enum

import pytest

from companion.config.link_models import ForwardConfig
from companion.config.yaml_source import ConfigError
from companion.flight.errors import FlightAbortedError, LandingAskedError
from companion.flight.shared_link.endpoints import Endpoint
from companion.flight.stages import mavsdk_mission, mission_backend
from companion.flight.stages.mavsdk_mission import MavsdkMission
from companion.flight.stages.mission_backend import OwnMission, make_backend
from companion.flight.vehicle.connection import Connection
from companion.link.memory import MemoryLink
from companion.mavlink.codec import Packer, encode
from companion.mavlink.dialects.px4 import Px4
from companion.mavlink.exchange import Verdict


class NoLog:
    def frame_in(self, time_s, raw):
        pass

    def frame_out(self, time_s, raw):
        pass


class Result(Enum):
    TIMEOUT = 8
    COMMAND_DENIED = 5


class ActionError(Exception):
    def __init__(self, result):
        super().__init__(result)
        self.result = result


class Action:
    """Does what it was told to, and remembers what the endpoint was allowed meanwhile."""

    def __init__(self, endpoint, ends_with=None, waits=None):
        self.endpoint, self.ends_with, self.waits = endpoint, ends_with, waits
        self.trusted = []
        self.height_m = None

    async def arm(self):
        self.trusted.append(self.endpoint.trusted)
        if self.waits is not None:
            await self.waits.wait()
        if self.ends_with is not None:
            raise self.ends_with

    takeoff = land = arm

    async def set_takeoff_altitude(self, height_m):
        self.height_m = height_m


class Stage:
    def __init__(self, autopilot=12, **action):
        self.link = MemoryLink(lambda data: None)
        self.connection = Connection(self.link, NoLog())
        self.autopilot = autopilot
        self.endpoint = Endpoint(ForwardConfig(url="udpin://127.0.0.1:0"))
        self.backend = MavsdkMission(self.connection)
        self.backend.attach(self.endpoint)
        self.action = self.backend._action = Action(self.endpoint, **action)

    def say_mode(self, custom_mode, base_mode=0x81):
        self.link.receive(
            Packer(1, 1).pack(
                encode(
                    "HEARTBEAT",
                    type=2, autopilot=self.autopilot, base_mode=base_mode, custom_mode=custom_mode,
                    system_status=4, mavlink_version=3,
                )
            )
        )  # fmt: skip


@pytest.fixture
async def stage():
    made = Stage()
    await made.link.open()
    made.say_mode(0)
    return made


async def test_what_it_commands_passes_only_while_the_flight_waits_for_it(stage):
    answer = await stage.backend.arm()

    assert answer.verdict is Verdict.ACCEPTED
    assert stage.action.trusted == [True]
    assert stage.endpoint.trusted is False


@pytest.mark.parametrize(
    ("result", "verdict", "said"),
    [
        (Result.TIMEOUT, Verdict.TIMED_OUT, "timeout"),
        (Result.COMMAND_DENIED, Verdict.REFUSED, "command denied"),
    ],
)
async def test_a_refusal_is_an_answer_and_says_what_mavsdk_said(stage, result, verdict, said):
    stage.action.ends_with = ActionError(result)

    answer = await stage.backend.arm()

    assert answer.verdict is verdict
    assert said in answer.explanation
    assert not stage.endpoint.trusted


async def test_arming_that_mavsdk_repeats_is_kept_back_once_the_vehicle_says_armed(stage):
    """Its own answer was lost, so it goes on asking; what somebody disarms now stays disarmed."""
    stage.say_mode(0, base_mode=0x01)
    stage.action.waits = asyncio.Event()
    stage.action.ends_with = ActionError(Result.TIMEOUT)
    asked = asyncio.ensure_future(stage.backend.arm())
    for _ in range(3):
        await asyncio.sleep(0)
    assert stage.endpoint.trusted

    stage.say_mode(0)
    for _ in range(3):
        await asyncio.sleep(0)

    assert not stage.endpoint.trusted
    assert not asked.done(), "MAVSDK must not be asked for a take-off while it still repeats this"
    stage.action.waits.set()
    assert (await asked).verdict is Verdict.ACCEPTED


async def test_what_breaks_inside_is_no_answer(stage):
    stage.action.ends_with = RuntimeError("null handle")
    with pytest.raises(RuntimeError, match="null handle"):
        await stage.backend.take_off(2.5)
    assert not stage.endpoint.trusted


async def test_a_person_who_asks_to_land_ends_the_wait_and_the_trust(stage):
    stage.action.waits = asyncio.Event()
    asked = asyncio.ensure_future(stage.backend.take_off(2.5))
    await asyncio.sleep(0)
    await asyncio.sleep(0)
    assert stage.endpoint.trusted
    stage.connection.waiting.interruption = LandingAskedError
    stage.connection.waiting.wake()

    with pytest.raises(LandingAskedError):
        await asked
    assert not stage.endpoint.trusted


async def test_landing_is_believed_when_the_vehicle_says_so(stage):
    landing = asyncio.ensure_future(stage.backend.land())
    for _ in range(5):
        await asyncio.sleep(0)
    assert not landing.done()

    stage.say_mode(Px4().custom_mode("land"))

    assert (await landing).verdict is Verdict.ACCEPTED


async def test_landing_that_the_vehicle_does_not_show_is_no_landing(stage, monkeypatch):
    monkeypatch.setattr(mavsdk_mission, "_MODE_FOLLOWS_S", 0.01)

    answer = await stage.backend.land()

    assert answer.verdict is Verdict.TIMED_OUT
    assert "the mode stayed" in answer.explanation


@pytest.mark.parametrize(("autopilot", "height_m"), [(12, None), (3, 3.0)])
async def test_the_height_is_set_where_the_autopilot_takes_one(autopilot, height_m):
    stage = Stage(autopilot)
    await stage.link.open()
    stage.say_mode(4)

    await stage.backend.take_off(3.0)

    assert stage.action.height_m == height_m


async def test_health_that_does_not_come_is_named(stage):
    class Unwell:
        async def health_all_ok(self):
            return False

    stage.backend._telemetry = Unwell()
    with pytest.raises(FlightAbortedError, match=r"health check was not content within 0\.01 s"):
        await stage.backend.become_ready(0.01)


async def test_the_companions_own_backend_needs_no_endpoint(stage):
    backend = make_backend("companion", stage.connection)

    assert isinstance(backend, OwnMission)
    assert backend.endpoints == ()


def test_without_mavsdk_the_remedy_is_named(monkeypatch):
    monkeypatch.setattr(mission_backend, "find_spec", lambda name: None)
    with pytest.raises(ConfigError, match=r"pip install 'companion\[mavsdk\]'"):
        mission_backend.require_mavsdk()


def test_an_older_mavsdk_is_told_from_none(monkeypatch):
    monkeypatch.setattr(
        mission_backend, "find_spec", lambda name: object() if name == "mavsdk" else None
    )
    with pytest.raises(ConfigError, match="needs MAVSDK 4"):
        mission_backend.require_mavsdk()
