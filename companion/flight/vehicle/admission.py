"""Which packets of the link are read at all: with a key, only those that carry its signature."""

from collections.abc import Callable

from companion.mavlink.framing import Frame
from companion.mavlink.signing import Rejection, Verifier

_TOLD = {
    Rejection.UNSIGNED: "is not signed",
    Rejection.BADLY_SIGNED: "is signed with another key than ours, or was changed on its way",
    Rejection.REPLAYED: "carries an old stamp: it was sent again, or overtaken by a newer one",
    Rejection.OUTDATED: "is stamped more than a minute before this computer's clock",
}
_REMARKS = {
    Rejection.UNSIGNED: (
        "were not read because they are not signed: give the vehicle the key (docs/signing.md), "
        "or fly without one here."
    ),
    Rejection.BADLY_SIGNED: (
        "were not read because their signatures are not by our key: the vehicle has another one. "
        "Give that one here, or ours to the vehicle (docs/signing.md)."
    ),
    Rejection.OUTDATED: (
        "were not read because they are stamped more than a minute before this computer's clock. "
        "Is the clock right?"
    ),
}
_NO_KEY = (
    "The autopilot's packets are signed, and no key was given here: what we send is not signed and "
    "so not accepted. Give its key with --signing-key-file or COMPANION_SIGNING_KEY."
)


class Admission:
    """Lets frames in, and counts those that it does not.

    Args:
        verifier: knows the key; None lets everything in.
    """

    __slots__ = ("_turned_away", "_verifier", "_warned", "on_rejected", "rejected")

    def __init__(self, verifier: Verifier | None) -> None:
        self._verifier = verifier
        self._warned = False
        self._turned_away = b""
        if verifier is not None:
            verifier.on_turned_away = self.turn_away
        self.rejected: dict[Rejection, int] = {}
        """Frames that were not let in, by the reason."""
        self.on_rejected: Callable[[str], None] | None = None
        """Told once for each reason, and once if the vehicle signs and we do not."""

    @property
    def checks(self) -> bool:
        """True with a key."""
        return self._verifier is not None

    def admit(self, frames: list[Frame]) -> list[Frame]:
        """The frames that may be read, in order."""
        verifier = self._verifier
        if verifier is None:
            return frames
        admitted = []
        for frame in frames:
            reason = verifier.check(frame)
            if reason is None:
                admitted.append(frame)
            else:
                self._reject(frame, reason)
        return admitted

    def turn_away(self, frame: Frame, reason: Rejection) -> None:
        """Count a vehicle's heartbeat that did not make its sender the link's peer.

        A link that listens for a stream's peer looks at one and the same packet again and again.
        """
        if frame.raw != self._turned_away:
            self._turned_away = frame.raw
            self._reject(frame, reason)

    def on_vehicle(self, frame: Frame) -> None:
        """Take a HEARTBEAT of the vehicle: does it expect signatures that we can't make?"""
        if frame.signed and self._verifier is None and not self._warned:
            self._warned = True
            self._tell(_NO_KEY)

    def remark(self, *, vehicle_known: bool) -> str:
        """What signing has to do with it that connecting failed; empty if nothing."""
        if self._verifier is None:
            return _NO_KEY if self._warned else ""
        if vehicle_known:
            return ""
        counts = {reason: self.rejected.get(reason, 0) for reason in _REMARKS}
        reason = max(counts, key=lambda reason: counts[reason])
        return f"{counts[reason]} packets {_REMARKS[reason]}" if counts[reason] else ""

    def _reject(self, frame: Frame, reason: Rejection) -> None:
        count = self.rejected.get(reason, 0)
        self.rejected[reason] = count + 1
        if count == 0:
            self._tell(
                f"a packet (message {frame.message_id}) of {frame.system_id}/{frame.component_id} "
                f"was not read, as all such will be: it {_TOLD[reason]}"
            )

    def _tell(self, text: str) -> None:
        if self.on_rejected is not None:
            self.on_rejected(text)
