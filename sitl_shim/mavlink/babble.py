"""Valid packets of no use to anybody, as a neighbour that has gone mad would send them."""

from sitl_shim.mavlink.wire import Packer, dialect

_COMPONENT_ID = 25
"""MAV_COMP_ID_USER1."""
_NUMBERS = 256
"""After so many packets the numbering of MAVLink begins again."""


def babble_packets(system_id: int) -> tuple[bytes, ...]:
    """DEBUG (254) of a component that nobody asked, numbered through once; never signed.

    Args:
        system_id: of the sender.
    """
    packer = Packer(system_id, _COMPONENT_ID)
    return tuple(
        packer.pack(dialect.MAVLink_debug_message(number, 0, float(number)))
        for number in range(1, _NUMBERS + 1)
    )
