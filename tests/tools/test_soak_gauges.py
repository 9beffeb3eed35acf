"""What a process holds."""

import asyncio
import mmap
import os
import sys

import pytest

from tools.soak.gauges import held_by, live_tasks

pytestmark = pytest.mark.skipif(not sys.platform.startswith("linux"), reason="reads /proc")


def test_an_open_file_is_a_handle_and_written_memory_is_held(tmp_path):
    before = held_by()
    block = mmap.mmap(-1, 32 * 1024 * 1024)  # new pages, whatever the allocator has in stock
    block.write(b"x" * len(block))
    with (tmp_path / "open").open("w"):
        during = held_by()
    block.close()
    after = held_by()
    assert (during.handles - before.handles, after.handles - before.handles) == (1, 0)
    assert during.memory_mib - before.memory_mib > 31.0
    assert after.memory_mib - before.memory_mib < 1.0
    assert before.memory_mib <= before.pss_mib <= before.rss_mib


def test_a_process_seen_from_outside_holds_what_it_sees_itself():
    assert held_by(os.getpid()).handles == held_by().handles
    assert held_by().threads >= 1


def test_tasks_count_as_long_as_anything_holds_them():
    async def nothing():
        pass

    before = live_tasks()

    async def main():
        task = asyncio.get_running_loop().create_task(nothing())
        await task
        return task

    with asyncio.Runner() as runner:
        task = runner.run(main())
    assert live_tasks() - before == 1
    del task
    assert live_tasks() == before
