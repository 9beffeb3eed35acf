"""The autopilot's clock: it begins anew with each boot, and its stamps can jump."""

_MOST_US = 8 * 10**15
"""TIMESYNC holds its nanoseconds in 63 bits."""


class BootClock:
    """What the autopilot's clock shows at a simulated time."""

    __slots__ = ("_pieces", "boot_us", "jump_us")

    def __init__(self) -> None:
        self.boot_us = 0
        """Simulated time of the last boot."""
        self.jump_us = 0
        """By how much stamps are ahead of the time since that boot."""
        self._pieces: list[tuple[int, int]] = [(0, 0)]

    def jump(self, by_us: int, now_us: int) -> None:
        """All stamps jump; a clock never shows less than 0, nor more than TIMESYNC can say.

        Args:
            by_us: forward.
            now_us: simulated time.
        """
        self.jump_us = min(_MOST_US, max(self.jump_us + by_us, self.boot_us - now_us))
        self._pieces.append((now_us, self.jump_us - self.boot_us))

    def reboot(self, now_us: int) -> None:
        """The clock starts at 0."""
        self.boot_us, self.jump_us = now_us, 0
        self._pieces.append((now_us, -now_us))

    def stamp_s(self, time_s: float) -> float:
        """What the clock showed at a simulated time."""
        offset_us = 0
        for since_us, offset in self._pieces:
            if since_us * 1e-6 <= time_s + 1e-9:
                offset_us = offset
        return time_s + offset_us * 1e-6
