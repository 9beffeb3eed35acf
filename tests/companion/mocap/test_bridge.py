import asyncio

from companion.config.mocap_models import MocapConfig
from companion.flight.clock import run_in_virtual_time
from companion.mocap.bridge import MocapBridge
from companion.mocap.json_input import write_pose
from companion.mocap.pose import RoomPose


def datagram(t, x=0.0):
    return write_pose("drone", RoomPose(t, (x, 0.0, 1.0), (1.0, 0.0, 0.0, 0.0)))


class Bench:
    """A bridge on a virtual clock, with cameras that are switched on and off."""

    def __init__(self, **settings):
        self.bridge = MocapBridge(MocapConfig(**settings))
        self.sent_s = []
        self.told = []
        self.lost = 0

        def lose():
            self.lost += 1

        self.bridge.on_lost = lose
        self._x = lambda t: 1e-6 * t

    def x_from(self, begin_s, x_m):
        """From a time on the body is seen elsewhere."""
        self._x = lambda t: 1e-6 * t + (x_m if t >= begin_s else 0.0)
        return self

    def still_from(self, begin_s):
        """From a time on the body is seen where it was."""
        self._x = lambda t: 1e-6 * min(t, begin_s)
        return self

    def run(self, duration_s, frames_hz, off=()):
        async def main():
            loop = asyncio.get_running_loop()
            running = loop.create_task(
                self.bridge.run(
                    lambda _: self.sent_s.append(loop.time()),
                    lambda severity, text: self.told.append((severity, text)),
                )
            )
            number = 0
            while loop.time() < duration_s:
                await asyncio.sleep((number + 1) / frames_hz - loop.time())
                number += 1
                if not any(begin <= loop.time() < end for begin, end in off):
                    data = datagram(loop.time() + 50.0, self._x(loop.time()))
                    self.bridge.receive(data, loop.time())
            running.cancel()

        run_in_virtual_time(main())
        return self


def test_fast_cameras_are_thinned_out_to_the_steady_rate():
    bench = Bench(rate_hz=50.0).run(2.0, frames_hz=240.0)
    assert 97 <= len(bench.sent_s) <= 101
    gaps = [b - a for a, b in zip(bench.sent_s, bench.sent_s[1:], strict=False)]
    assert max(gaps) < 0.0201


def test_slow_cameras_make_no_pose_leave_twice():
    bench = Bench(rate_hz=100.0).run(2.0, frames_hz=25.0)
    assert len(bench.sent_s) in (49, 50)


def test_a_stall_of_the_cameras_is_not_made_up_for():
    bench = Bench(rate_hz=50.0).run(2.0, frames_hz=100.0, off=[(1.0, 1.3)])
    assert not [t for t in bench.sent_s if 1.03 < t < 1.29]
    assert 80 <= len(bench.sent_s) <= 87
    assert bench.lost == 0


def test_a_lost_stream_is_told_once_and_so_is_its_return():
    bench = Bench(timeout_s=0.3).run(3.0, frames_hz=100.0, off=[(1.0, 2.0)])
    assert [severity for severity, _ in bench.told] == ["info", "error", "info"]
    assert "no usable pose of 'drone' for 0.3 s" in bench.told[1][1]
    assert bench.lost == 1


def test_before_the_first_pose_nothing_is_lost_and_nothing_leaves():
    bench = Bench().run(1.0, frames_hz=100.0, off=[(0.0, 5.0)])
    assert (bench.sent_s, bench.told, bench.lost) == ([], [], 0)
    assert not bench.bridge.alive(1.0)


def test_it_says_what_came_instead():
    bridge = MocapBridge(MocapConfig())
    bridge.receive(b"rubbish", 0.0)
    bridge.receive(datagram(1.0).replace(b"drone", b"chair"), 0.0)
    bridge.receive(datagram(1.0), 0.0)
    bridge.receive(datagram(1.0), 0.0)
    assert bridge.describe() == "1 usable, 1 not JSON, 1 of another body, 1 out of order"


def test_a_jump_is_told_and_counted_for_the_autopilot():
    bridge = MocapBridge(MocapConfig())
    for k in range(10):
        bridge.receive(datagram(0.01 * k), 1.0 + 0.01 * k)
    for k in range(10, 120):
        bridge.receive(datagram(0.01 * k, x=5.0), 1.0 + 0.01 * k)
    assert bridge.jumps == 1
    message = bridge.beat()
    assert message is not None
    assert message.payload[-3] == 1
    assert bridge.beat() is None


def test_a_jump_once_armed_is_a_lost_stream_and_none_of_its_poses_leaves():
    bench = Bench(timeout_s=0.3)
    bench.bridge.armed = lambda: True
    bench.x_from(1.0, 2.0).run(4.0, frames_hz=100.0)
    assert max(bench.sent_s) < 1.03
    assert bench.bridge.jumps == 0
    assert bench.lost == 1
    severity, text = bench.told[-1]
    assert severity == "error"
    assert "The poses jumped by 2.0 m" in text


def test_a_pose_that_is_repeated_once_armed_is_a_lost_stream():
    bench = Bench(timeout_s=0.3)
    bench.bridge.armed = lambda: True
    bench.still_from(1.0).run(2.0, frames_hz=100.0)
    assert max(bench.sent_s) < 1.03
    assert bench.lost == 1
    assert "the system repeats it" in bench.told[-1][1]
