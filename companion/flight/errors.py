"""How a flight, or a stage of it, ends other than as planned."""


class FlightRefusedError(Exception):
    """A check refused the flight before arming; the text names what, where and the remedy."""


class FlightAbortedError(Exception):
    """The flight could not be completed; the text says why and what the vehicle does now."""


class LinkLostError(FlightAbortedError):
    """The autopilot is not to be heard any more, so that nothing can be asked of it."""


class DisarmedError(FlightAbortedError):
    """The vehicle was disarmed while it should fly: there is nothing left to land."""


class HandedOverError(Exception):
    """The companion does not fly any more; the text says why.  A person's word may end that."""


class LandingAskedError(Exception):
    """A person wants the vehicle to land now."""


class ShimRefusedError(Exception):
    """The embedded shim can't simulate what it was asked for; the text says what and why."""
