"""SETUP_SIGNING: the vehicle is given a signing key, another one, or none any more.

https://docs.px4.io/main/en/mavlink/message_signing.  Taken over any link while there is no key;
with one, the message must be signed with it, as all must.  Not taken while armed; never passed on.
"""

from collections.abc import Callable, Mapping

from sitl_shim.mavlink.services.context import Context
from sitl_shim.mavlink.wire import Message


class SigningSetup:
    """Takes keys.

    Args:
        context: of the vehicle.
    """

    def __init__(self, context: Context) -> None:
        self._context = context

    @property
    def handlers(self) -> Mapping[str, Callable[[int, Message], None]]:
        """What it reads."""
        return {"SETUP_SIGNING": self._set_up}

    def _set_up(self, link: int, message: Message) -> None:
        context = self._context
        if not context.concerns(message, any_system=True) or context.sim.autopilot.armed:
            return
        key = bytes(message.secret_key)
        # Zeros as the key are a key, though a poor one, unless the stamp is zero, too.
        off = not any(key) and message.initial_timestamp == 0
        context.signing.set_up(None if off else key, message.initial_timestamp)
        for index, other in enumerate(context.links):
            other.sign(context.signing, index)
