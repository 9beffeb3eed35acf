"""How a flight ends other than by landing after its trajectory."""


class FlightRefusedError(Exception):
    """A check refused the flight before arming; the text names what, where and the remedy."""


class FlightAbortedError(Exception):
    """The flight could not be completed; the text says why and what the vehicle does now."""


class LinkLostError(FlightAbortedError):
    """The autopilot is not to be heard any more, so that nothing can be asked of it."""
