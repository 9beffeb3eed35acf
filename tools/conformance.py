"""Writes docs/conformance.md: real clients, step by step, against both flavours.

    python tools/conformance.py

Needs the extras of `dev`, a minute or two for each client and flavour, and real time.
"""

import asyncio
import sys
from pathlib import Path

ROOT = Path(__file__).parents[1]
sys.path.insert(0, str(ROOT))

from tests.conformance import mavproxy_client, mavsdk_client  # noqa: E402
from tests.conformance.page import page  # noqa: E402
from tests.conformance.steps import FLAVOURS, Session  # noqa: E402


async def _run() -> list[Session]:
    sessions = []
    for client in (mavsdk_client, mavproxy_client):
        for flavour in FLAVOURS:
            session = await client.run(flavour)
            print(f"{session.client} with {flavour}:")
            for step in session.steps:
                verdict = "yes" if step.passed else "NO "
                print(f"  {verdict} {step.name} ({step.seconds:.1f} s): {step.seen}")
            sessions.append(session)
    return sessions


def main() -> int:
    """Run all clients against both flavours, write the page, say what failed."""
    sessions = asyncio.run(_run())
    (ROOT / "docs" / "conformance.md").write_text(page(sessions))
    failures = sum(len(session.failures) for session in sessions)
    print(f"docs/conformance.md is written; {failures} steps failed")
    return 1 if failures else 0


if __name__ == "__main__":
    sys.exit(main())
