"""How each flavour speaks the mission protocol."""

from collections.abc import Mapping
from dataclasses import dataclass

from sitl_shim.mavlink import messages_ardupilot, messages_status
from sitl_shim.mavlink.services.mission_items import CANCELLED, INVALID_SEQUENCE, NO_SPACE
from sitl_shim.mavlink.streams import Builder


@dataclass(frozen=True, slots=True)
class MissionManners:
    """Times, results and texts."""

    retry_us: int
    """An item that does not come is asked for again after this."""
    timeout_us: int
    """A transfer on which nothing comes is given up after this."""
    timeout_text: str
    timeout_result: int | None
    """MAV_MISSION_RESULT that goes with giving up; None: nothing is sent."""
    capacity: tuple[int, int, int]
    """Items of a mission, a fence, a list of rally points."""
    home_first: bool
    """Item 0 of the mission is home."""
    any_order: bool
    """Items may be asked for in any order, without a transfer being open; else in turn."""
    unexpected_item_result: int | None
    """To an item that was not asked for; None: silence."""
    too_many_result: int
    forgives_repetition: bool
    """An item that comes again after the end is acknowledged again."""
    tells_current_at_once: bool
    """MISSION_CURRENT comes when the current item changes; else every second only."""
    streams_current: bool
    """MISSION_CURRENT comes every second, on every link, unasked."""
    reached_repetitions: int
    """MISSION_ITEM_REACHED is sent again so often, once a second."""
    mission_current: Builder
    """MISSION_CURRENT."""
    severity: int
    """MAV_SEVERITY of its texts."""
    text_end: str


_MANNERS: Mapping[str, MissionManners] = {
    "px4": MissionManners(
        retry_us=250_000,
        timeout_us=5_000_000,
        timeout_text="Operation timeout",
        timeout_result=None,
        capacity=(2000, 64, 32),
        home_first=False,
        any_order=False,
        unexpected_item_result=None,
        too_many_result=NO_SPACE,
        forgives_repetition=True,
        tells_current_at_once=False,
        streams_current=True,
        reached_repetitions=10,
        mission_current=messages_status.mission_current,
        severity=2,
        text_end="\t",
    ),
    "ardupilot": MissionManners(
        retry_us=1_000_000,
        timeout_us=8_000_000,
        timeout_text="Mission upload timeout",
        timeout_result=CANCELLED,
        capacity=(718, 256, 64),
        home_first=True,
        any_order=True,
        unexpected_item_result=INVALID_SEQUENCE,
        too_many_result=NO_SPACE,
        forgives_repetition=False,
        tells_current_at_once=True,
        streams_current=False,
        reached_repetitions=0,
        mission_current=messages_ardupilot.mission_current,
        severity=4,
        text_end="",
    ),
}


def manners_of(flavour: str) -> MissionManners:
    """Manners of a flavour, by its name."""
    return _MANNERS[flavour]
