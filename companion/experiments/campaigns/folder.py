"""A campaign's folder: who writes to it, and what is in it already."""

import fcntl
import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from companion.config.yaml_source import ConfigError
from companion.experiments.campaigns.manifest import read_manifest
from companion.experiments.campaigns.plan import Plan
from companion.experiments.campaigns.results import Row, is_done, read_journal

_LOCK = ".lock"


@contextmanager
def owned(folder: Path) -> Iterator[None]:
    """Be the only campaign that writes to a folder, which is made; a death gives it free.

    Raises:
        ConfigError: another one writes to it.
        OSError: it can't be written.
    """
    folder.mkdir(parents=True, exist_ok=True)
    lock = os.open(folder / _LOCK, os.O_RDWR | os.O_CREAT, 0o644)
    try:
        try:
            fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError as error:
            raise ConfigError(
                f"{folder}: another campaign is writing to it. Wait for it, or give another folder "
                "with --out."
            ) from error
        yield
    finally:
        os.close(lock)


def rows_before(folder: Path, plan: Plan, *, resume: bool) -> list[Row]:
    """What was flown in a folder before, of this very plan.

    Raises:
        ConfigError: there is a campaign, and it is not to be gone on with, or another one.
    """
    manifest = read_manifest(folder)
    if manifest is None:
        return []
    rows = [row for row in read_journal(folder) if is_done(row)]
    if not resume:
        raise ConfigError(
            f"{folder} holds {len(rows)} of {manifest.flights} flights of the campaign "
            f"'{manifest.name}'. Go on with --resume, or give another folder with --out."
        )
    if manifest.plan != plan.digest:
        raise ConfigError(
            f"{folder} holds the flights of another plan ('{manifest.name}', "
            f"{manifest.flights} flights; {plan.path} has changed since, or the library that "
            "samples). Give another folder with --out, or the file as it was: campaign.json has "
            "it."
        )
    return rows
