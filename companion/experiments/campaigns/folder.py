"""A campaign's folder: who writes to it, and what is in it already."""

import fcntl
import os
import shutil
from collections.abc import Iterator, Set
from contextlib import contextmanager
from pathlib import Path

from companion.config.yaml_source import ConfigError
from companion.experiments.campaigns.manifest import MANIFEST, Manifest, read_manifest
from companion.experiments.campaigns.plan import Plan
from companion.experiments.campaigns.results import (
    JOURNAL,
    RESULTS,
    Row,
    is_done,
    read_journal,
    write_journal,
)

PLANTS = "plants"
_LOCK = ".lock"
_KEPT = (MANIFEST, JOURNAL, RESULTS)


@contextmanager
def owned(folder: Path) -> Iterator[None]:
    """Be the only campaign that writes to a folder, which is made; a death gives it free.

    Where nothing was begun in it, nothing is left of it.

    Raises:
        ConfigError: another one writes to it, or it is a file.
        OSError: it can't be written.
    """
    made = [path for path in (folder, *folder.parents) if not path.exists()]
    had_plants = (folder / PLANTS).exists()
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except (FileExistsError, NotADirectoryError) as error:
        raise ConfigError(f"{folder}: not a folder. Give another one with --out.") from error
    lock = _locked(folder)
    try:
        yield
    finally:
        if not any((folder / name).exists() for name in _KEPT):
            if not had_plants:
                shutil.rmtree(folder / PLANTS, ignore_errors=True)
            (folder / _LOCK).unlink(missing_ok=True)
            _remove_empty(made)
        os.close(lock)


def _locked(folder: Path) -> int:
    """The lock's file, open; it may be taken away by its owner while one waits to open it."""
    path = folder / _LOCK
    while True:
        lock = os.open(path, os.O_RDWR | os.O_CREAT, 0o644)
        try:
            fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
            if path.exists() and os.path.samestat(os.fstat(lock), path.stat()):
                return lock
        except BlockingIOError as error:
            os.close(lock)
            raise ConfigError(
                f"{folder}: another campaign is writing to it. Wait for it, or give another folder "
                "with --out."
            ) from error
        os.close(lock)
        folder.mkdir(parents=True, exist_ok=True)


def _remove_empty(folders: list[Path]) -> None:
    for folder in folders:
        try:
            folder.rmdir()
        except OSError:
            return


def rows_before(folder: Path, plan: Plan, *, resume: bool) -> list[Row]:
    """What was flown in a folder before, of this very plan.

    Raises:
        ConfigError: there is a campaign, and it is not to be gone on with, or another one; or
            there is none, and one was to be gone on with.
        OSError: a file can't be read.
    """
    manifest = read_manifest(folder)
    if manifest is None:
        _refuse_what_nobody_knows(folder)
        if resume:
            raise ConfigError(
                f"{folder} holds no campaign that --resume could go on with. Give its folder with "
                "--out, or leave --resume out."
            )
        return []
    rows = [row for row in read_journal(folder) if is_done(row)]
    if not resume:
        if not _holds_flights(folder):
            return []
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
    _refuse_what_was_not_kept(folder, manifest, plan, rows)
    return rows


def refuse_others(folder: Path, count: int) -> None:
    """Refuse to go on where other code flew, or with other files.

    Args:
        folder: of the campaign.
        count: how many flights nothing of the plan has any more.

    Raises:
        ConfigError: always, with what to do.
    """
    manifest = read_manifest(folder)
    said = manifest.said if manifest is not None else {}
    raise ConfigError(
        f"{folder}: {count} flights were flown by other code or with other files (version "
        f"{said.get('version')}, commit {said.get('commit')}). Go on with that version and those "
        "files, give another folder with --out, or fly them again with --resume --anew, which "
        "keeps the old rows beside the new ones."
    )


def set_aside(folder: Path, rows: list[Row], others: Set[str]) -> Path:
    """Make room for flights that other code flew, or that had other files; their rows are kept.

    Args:
        folder: of the campaign.
        rows: that are there.
        others: keys of those that nothing of the plan has any more.

    Returns:
        Where the campaign is kept as it was.

    Raises:
        OSError: it can't be kept.
    """
    number = 1
    while (kept := folder / f"before-{number}").exists():
        number += 1
    unfinished = folder / f".unfinished.{kept.name}"
    shutil.rmtree(unfinished, ignore_errors=True)
    unfinished.mkdir()
    for name in _KEPT:
        if (folder / name).is_file():
            shutil.copy2(folder / name, unfinished / name)
    unfinished.rename(kept)
    write_journal(folder, [row for row in rows if row["key"] not in others])
    return kept


def _refuse_what_nobody_knows(folder: Path) -> None:
    for name in (JOURNAL, RESULTS):
        if (folder / name).exists():
            raise ConfigError(
                f"{folder} holds {name} and no {MANIFEST}, which says what was flown. Put it back, "
                "or give another folder with --out."
            )


def _refuse_what_was_not_kept(
    folder: Path, manifest: Manifest, plan: Plan, rows: list[Row]
) -> None:
    keep = plan.config.keep
    if rows and plan.config.engine == "flights" and keep == "flights":
        before = manifest.said.get("keep", keep)
        if before != keep:
            raise ConfigError(
                f"{plan.path} says keep: {keep}, and the {len(rows)} flights in {folder} were "
                f"flown with keep: {before}, without their data. Say keep: {before} again, or give "
                "another folder with --out."
            )


def _holds_flights(folder: Path) -> bool:
    """Whether anything was flown there, whatever became of it."""
    import pyarrow.parquet as parquet

    if read_journal(folder) or any((folder / "flights").glob("*.parquet")):
        return True
    if not (folder / RESULTS).is_file():
        return False
    try:
        return bool(parquet.read_metadata(folder / RESULTS).num_rows)
    except Exception:  # pyarrow's own kinds: it is damaged, and may be all that is left
        return True
