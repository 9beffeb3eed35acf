"""Writes docs/yaml.md from the models that read YAML: ``python -m tools.docs.yaml_reference``.

With ``--check`` nothing is written; the exit status says whether the page is as the models are.
"""

import argparse
import re
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from companion.config.describe import KeyDescription, SectionDescription, describe
from tools.schemas import MODELS

PAGE = Path(__file__).parents[2] / "docs" / "yaml.md"
_COLUMNS = "| key | value | default | |\n|---|---|---|---|"
_INTRODUCTION = """\
# YAML reference

Every key of every file, read from the models that check the files: this page is written by
`python -m tools.docs.yaml_reference`, and a test holds it to them.

- A key that no model knows is refused, and so is a value that it does not take: with file, line,
  key and what would be right.
- Every key of a mission can be set on the command line, too: `--set monitor.act=false`. What is set
  there wins over the file; `--set controller.mpc.horizon=40` and `--set vehicle.hover_thrust=0.5`
  reach into the files that the mission names.
- Paths in a file are relative to that file's folder. A name without `.yaml` means a shipped one.
- Units and frames are in the keys: `_m`, `_s`, `_m_s`, `_deg`; `enu` is x east, y north, z up.
- `companion new mission` (`controller`, `vehicle`, …) writes a file to begin with, every key in it.
- Editors complete and check these files by the JSON Schemas in
  [configs/schemas](../configs/schemas/): a first line
  `# yaml-language-server: $schema=…/mission.json` names one.
"""


@dataclass(frozen=True, slots=True)
class _Kind:
    """What is said of a kind of file before its keys."""

    title: str
    text: str


_KINDS = {
    "mission": _Kind(
        "Mission",
        "A flight: what is flown, by what, where. `companion fly --mission FILE`; shipped: "
        "[configs/missions](../configs/missions/). Every key may be left out.",
    ),
    "controller": _Kind(
        "Controller",
        "Gains, and where they came from. `--controller NAME` or a file; shipped, one for "
        "each vehicle: [configs/controllers](../configs/controllers/). Which sections a file has "
        "follows from its `framework`.",
    ),
    "vehicle": _Kind(
        "Vehicle",
        "What is known of a vehicle. `--vehicle NAME` or a file; shipped: "
        "[configs/vehicles](../configs/vehicles/). [`companion identify`](identify.md) writes one.",
    ),
    "trajectory": _Kind(
        "Trajectory",
        "Timed points of one's own; a CSV file with the header `t,x,y,z` says the same. "
        "`--traj FILE`; examples: [configs/trajectories](../configs/trajectories/).",
    ),
    "scenario": _Kind(
        "Scenario",
        "Wind and sudden events of the embedded shim. `--wind NAME` or a file; shipped: "
        "[configs/scenarios](../configs/scenarios/); more in [scenarios](scenarios.md).",
    ),
    "faults": _Kind(
        "Faults",
        "What goes wrong on purpose. `--faults NAME` or a file; shipped: "
        "[configs/faults](../configs/faults/); more in [faults](faults.md).",
    ),
    "sensors": _Kind(
        "Sensors",
        "Errors of the simulated autopilot's estimate. `--sensors NAME` or a file; shipped: "
        "[sitl_shim/sensors/profiles](../sitl_shim/sensors/profiles/).",
    ),
    "campaign": _Kind(
        "Campaign",
        "Many flights over sampled parameters. `companion campaign NAME` or a file; shipped: "
        "[configs/campaigns](../configs/campaigns/); more in [campaigns](campaigns.md).",
    ),
    "fault-table": _Kind(
        "Table of faults",
        "The rows that `companion faults` flies: "
        "[configs/fault-table.yaml](../configs/fault-table.yaml); more in "
        "[the fault table](fault-table.md).",
    ),
}


def page() -> str:
    """The whole page."""
    parts = [_INTRODUCTION]
    for kind, model in MODELS.items():
        said = _KINDS.get(kind, _Kind(kind.capitalize(), ""))
        section = describe(model)
        parts.append(f"## {said.title}\n\n{said.text or section.text}\n")
        parts.append(_table(section, said.title))
        parts += [_headed(key, inner, said.title) for key, inner in _below(section)]
    return "\n".join(parts)


def _below(section: SectionDescription) -> Iterator[tuple[KeyDescription, SectionDescription]]:
    """The sections within one, each with the key that it stands below."""
    for key in section.keys:
        for inner in key.sections:
            yield key, inner
            yield from _below(inner)


def _headed(key: KeyDescription, section: SectionDescription, kind: str) -> str:
    said = _escaped(section.text)
    return f"### {_heading(key, section, kind)}\n\n{said}\n\n{_table(section, kind)}"


def _heading(key: KeyDescription, section: SectionDescription, kind: str) -> str:
    which = f" ({section.name})" if len(key.sections) > 1 else ""
    return f"{kind}: `{key.path}`{which}"


def _table(section: SectionDescription, kind: str) -> str:
    return "\n".join([_COLUMNS, *(_row(key, kind) for key in section.keys)]) + "\n"


def _row(key: KeyDescription, kind: str) -> str:
    default = "**required**" if key.required else f"`{key.default}`" if key.default else ""
    name = f"`{key.name}`"
    if key.sections:
        name = f"[{name}](#{_anchor(_heading(key, key.sections[0], kind))})"
    cells = (name, _value(key), default.replace("|", "\\|"), _escaped(key.text))
    return f"| {' | '.join(cells)} |"


def _anchor(heading: str) -> str:
    """As a forge makes it, and the site."""
    return re.sub(r"[^\w\- ]", "", heading.lower()).replace(" ", "-")


def _value(key: KeyDescription) -> str:
    """What may be written there, in words."""
    if key.choices:
        return ", ".join(f"`{choice}`" for choice in key.choices).replace("|", "\\|")
    more = ", ".join(part for part in (key.unit, key.limits) if part)
    return _escaped(f"{key.type}, {more}" if more else key.type)


def _escaped(text: str) -> str:
    """Text fit for a cell: nothing in it begins a cell, a tag, or emphasis."""
    one_line = " ".join(text.split())
    parts = one_line.split("`")
    for at in range(0, len(parts), 2):  # outside of code
        parts[at] = parts[at].replace("*", "\\*").replace("<", "&lt;").replace("_", "\\_")
    return "`".join(parts).replace("|", "\\|")


def main(arguments: list[str] | None = None) -> int:
    """Write the page, or check it; the exit status."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--check", action="store_true")
    asked = parser.parse_args(arguments)
    if not asked.check:
        PAGE.write_text(page(), encoding="utf-8")
        return 0
    same = PAGE.read_text(encoding="utf-8") == page()
    if not same:
        print(f"{PAGE} is not what the models say: python -m tools.docs.yaml_reference")
    return 0 if same else 1


if __name__ == "__main__":
    sys.exit(main())
