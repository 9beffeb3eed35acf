"""A point of a campaign as its folder has it: the file may have changed since, or be gone."""

import tempfile
from pathlib import Path

from companion.config.yaml_source import ConfigError
from companion.experiments.campaigns.manifest import MANIFEST, read_manifest
from companion.experiments.campaigns.plan import Plan, plan_of
from companion.experiments.campaigns.results import read_journal
from companion.experiments.campaigns.tasks import task_of
from companion.experiments.flight_task import code_digest


def plan_of_folder(folder: Path) -> Plan:
    """The plan of what was flown in a folder, from its own copy of the file's text.

    Raises:
        ConfigError: there is no campaign, or its text gives another plan today.
        OSError: it can't be read.
    """
    manifest = read_manifest(folder)
    if manifest is None:
        raise ConfigError(f"{folder}: it holds no {MANIFEST}. Give a campaign's file or folder.")
    said = manifest.said
    text, path = said.get("yaml"), said.get("path") or said.get("file")
    if not isinstance(text, str) or not isinstance(path, str):
        raise ConfigError(f"{folder / MANIFEST}: it lacks the campaign's text (yaml, path).")
    plan = plan_of(text, Path(path))
    if plan.digest != manifest.plan:
        raise ConfigError(
            f"{folder}: its points are not those that this program takes from the same text "
            f"({MANIFEST}: version {said.get('version')}, commit {said.get('commit')}; the library "
            "that samples may be another). Fly it with that version."
        )
    return plan


def check_point(folder: Path, plan: Plan, point: int) -> str | None:
    """See that a point is still the flight whose row the folder has.

    Returns:
        What a person should know: other code will fly it; None: nothing.

    Raises:
        ConfigError: files that it names have changed.
        OSError: one can't be read.
    """
    manifest = read_manifest(folder)
    row = next((row for row in read_journal(folder) if row["point"] == point), None)
    if manifest is None or row is None or not 0 <= point < len(plan.flights):
        return None
    if _key(plan, point) == row["key"]:
        return None
    said = manifest.said
    if plan.config.engine == "flights" and said.get("code") == code_digest():
        raise ConfigError(
            f"{folder}: point {point} names files (beside {plan.path}) that have changed since it "
            "was flown: it would be another flight. Put them back as they were, or fly it as they "
            f"are: companion campaign {plan.path} --point {point}"
        )
    return (
        f"point {point} was flown by other code, or with other files (version "
        f"{said.get('version')}, commit {said.get('commit')}): what follows may differ from its row"
    )


def _key(plan: Plan, point: int) -> str:
    flight = plan.flights[point]
    if plan.config.engine == "batched":
        from companion.experiments.campaigns.batches import batch_key_of

        return batch_key_of(plan, flight)
    with tempfile.TemporaryDirectory(prefix="companion-point-") as folder:
        return task_of(plan, flight, Path(folder)).key
