"""What differs between the flavours on the wire, as data."""

from collections.abc import Mapping
from dataclasses import dataclass

from sitl_shim.autopilot.interface import Announcement
from sitl_shim.mavlink import messages_status as status
from sitl_shim.mavlink import streams, streams_ardupilot
from sitl_shim.mavlink.streams import Builder, LinkKind


@dataclass(frozen=True, slots=True)
class Personality:
    """Manners of one flavour on its links."""

    name: str
    builders: Mapping[int, Builder]
    """Messages that can be streamed, by id, in the order in which they leave."""
    requestable: Mapping[int, Builder]
    """Messages that REQUEST_MESSAGE brings."""
    rates_hz: Mapping[LinkKind, Mapping[int, float]]
    """What each kind of link streams from the start."""
    fixed_rates: frozenset[int]
    """Messages whose rate nobody may change."""
    about_status: frozenset[int]
    """Messages that wait until the status is published anew."""
    listens_from_us: int
    """Boot time from which it answers and streams."""
    grid_origin_us: int
    """Due times are whole intervals from here."""
    legacy_groups: Mapping[int, tuple[int, ...]] | None
    """What REQUEST_DATA_STREAM asks for; None: it changes nothing."""
    unknown_interval_result: int
    """MAV_RESULT of an interval for a message that it does not stream."""
    unknown_request_result: int
    """MAV_RESULT of a request for a message that it does not have."""
    says_unknown_message: bool
    """Whether a text tells of an interval for a message that it does not stream."""
    interval_step_us: int
    """Intervals are cut to whole multiples of this."""
    shortest_interval_us: int
    """Shorter intervals are denied."""
    message_before_acknowledgement: bool
    """Order of the answers to REQUEST_MESSAGE."""
    quiet_while_booting: bool
    """Whether nothing but HEARTBEAT and TIMESYNC is streamed while the state is MAV_STATE_BOOT."""
    texts_to_every_link: bool
    """Else only to links on which a ground station is heard."""
    held_share: float
    """Probability that what would leave at a tick waits for the next: arrivals in bursts."""
    longest_held_us: int
    """No message waits longer."""
    bytewise_parameters: bool
    """Integers stand in PARAM_VALUE's float field by their bits; else as their value."""
    parameter_errors: bool
    """Whether PARAM_ERROR says why a parameter was not read or set; else there is silence."""
    parameter_hash: bool
    """Whether `_HASH_CHECK` exists."""
    tells_parameters_us: int | None
    """Boot time at which it tells unasked which parameters the airframe has set."""
    parameter_file: bool
    """Whether FTP has the packed file of the parameters."""
    client_numbers_files: bool
    """An open file has the session number that its request bore; else the vehicle chooses one."""
    events: bool
    """Whether EVENT (410) is sent to companions."""
    answers_with_parameter_index: bool
    """PARAM_VALUE that answers READ and SET has the index of the list; else 65535."""
    tells_changes_again: bool
    """A parameter that was set is told to all links a moment later, to the asker once more; else
    to the other links alone."""
    announcements: Mapping[Announcement, Builder]
    """Messages that go to all links when something changes."""


_PX4 = Personality(
    name="px4",
    builders=streams.BUILDERS,
    requestable=streams.REQUESTABLE,
    rates_hz=streams.RATES_HZ,
    fixed_rates=frozenset({streams.HEARTBEAT_ID}),
    about_status=streams.ABOUT_STATUS,
    listens_from_us=440_000,
    grid_origin_us=200_000,  # its first heartbeat comes 1.2 s after boot
    legacy_groups=None,
    unknown_interval_result=4,
    unknown_request_result=2,
    says_unknown_message=False,
    interval_step_us=1,
    shortest_interval_us=0,
    message_before_acknowledgement=True,
    quiet_while_booting=False,
    texts_to_every_link=False,
    held_share=0.0,
    longest_held_us=0,
    bytewise_parameters=True,
    parameter_errors=True,
    parameter_hash=True,
    tells_parameters_us=480_000,
    parameter_file=False,
    client_numbers_files=False,
    events=True,
    answers_with_parameter_index=True,
    tells_changes_again=True,
    announcements={Announcement.ORIGIN: status.gps_global_origin},
)

_ARDUPILOT = Personality(
    name="ardupilot",
    builders=streams_ardupilot.BUILDERS,
    requestable=streams_ardupilot.REQUESTABLE,
    rates_hz=dict.fromkeys(LinkKind, streams_ardupilot.RATES_HZ),
    fixed_rates=frozenset(),
    about_status=frozenset(),
    listens_from_us=400_000,
    grid_origin_us=32_000,
    legacy_groups=streams_ardupilot.LEGACY_GROUPS,
    unknown_interval_result=2,
    unknown_request_result=4,
    says_unknown_message=True,
    interval_step_us=1_000,
    shortest_interval_us=3_000,
    message_before_acknowledgement=False,
    quiet_while_booting=True,
    texts_to_every_link=True,
    held_share=0.26,  # lateness of 2.7 ms standard deviation, in steps of 4 ms
    longest_held_us=16_000,
    bytewise_parameters=False,
    parameter_errors=False,
    parameter_hash=False,
    tells_parameters_us=None,
    parameter_file=True,
    client_numbers_files=True,
    events=False,
    answers_with_parameter_index=False,
    tells_changes_again=False,
    announcements=streams_ardupilot.ANNOUNCEMENTS,
)

_PERSONALITIES: Mapping[str, Personality] = {"px4": _PX4, "ardupilot": _ARDUPILOT}


def personality_of(flavour: str) -> Personality:
    """Manners of a flavour, by its name."""
    return _PERSONALITIES[flavour]
