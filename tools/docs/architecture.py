"""Draws the architecture from the imports: ``python -m tools.docs.architecture``.

The rooms of the two packages are what lies directly in them; who imports whom is read by grimp, the
layers are those that import-linter keeps (pyproject.toml).  Written are
docs/images/architecture.json, docs/images/architecture.svg, and the table in docs/architecture.md.
"""

import argparse
import ast
import json
import re
import tomllib
from pathlib import Path
from typing import Any

import grimp

from tools.docs.architecture_picture import draw

ROOT = Path(__file__).parents[2]
DATA = ROOT / "docs" / "images" / "architecture.json"
PAGE = ROOT / "docs" / "architecture.md"
BEGIN, END = "<!-- rooms -->", "<!-- end of rooms -->"
PACKAGES = ("companion", "sitl_shim")

Data = dict[str, Any]


def gather() -> Data:
    """Layers, rooms with their first sentences, and imports between rooms, as JSON has them."""
    layers = _layers()
    imports = _imports_between_rooms()
    rooms = sorted({*imports, *(r for below in imports.values() for r in below)})
    known = {room for rows in layers.values() for row in rows for room in row}
    for package in PACKAGES:
        unlisted = [r for r in rooms if r.startswith(f"{package}.") and r not in known]
        if unlisted:
            layers[package].insert(0, unlisted)
    return {
        "layers": {
            package: [[r for r in row if r in rooms] for row in rows]
            for package, rows in layers.items()
        },
        "rooms": {room: _first_sentence(room) for room in rooms},
        "imports": imports,
    }


def _layers() -> dict[str, list[list[str]]]:
    """Rows of rooms by package, the uppermost first, as the contracts have them."""
    contracts = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
    found: dict[str, list[list[str]]] = {}
    for contract in contracts["tool"]["importlinter"]["contracts"]:
        if contract["type"] != "layers":
            continue
        container = next(iter(contract.get("containers", [])), None)
        rows = [re.findall(r"[\w.]+", row) for row in contract["layers"]]
        named = [[f"{container}.{r}" if container else r for r in row] for row in rows]
        found[named[0][0].partition(".")[0]] = named
    return found


def _imports_between_rooms() -> dict[str, list[str]]:
    graph = grimp.build_graph(*PACKAGES, cache_dir=None)
    found: dict[str, set[str]] = {}
    for module in graph.modules:
        for imported in graph.find_modules_directly_imported_by(module):
            room, below = _room(module), _room(imported)
            if room and below and room != below:
                found.setdefault(room, set()).add(below)
    return {room: sorted(below) for room, below in sorted(found.items())}


def _room(module: str) -> str:
    """What lies directly in a package; empty for the packages themselves and `__main__`."""
    parts = module.split(".")
    return "" if len(parts) < 2 or parts[1] == "__main__" else ".".join(parts[:2])


def _first_sentence(room: str) -> str:
    path = ROOT.joinpath(*room.split("."))
    file = path / "__init__.py" if path.is_dir() else path.with_suffix(".py")
    said = ast.get_docstring(ast.parse(file.read_text(encoding="utf-8"))) or ""
    first = re.split(r"(?<=[.;])\s", " ".join(said.split()), maxsplit=1)[0]
    return first.rstrip(".;")


def table(data: Data) -> str:
    """The rooms as Markdown, by layer, the uppermost first."""
    lines = []
    for package, rows in data["layers"].items():
        lines += [f"**`{package}`**", "", "| room | what it does | imports |", "|---|---|---|"]
        for row in rows:
            for room in row:
                below = ", ".join(f"`{_short(b, package)}`" for b in data["imports"].get(room, []))
                says = data["rooms"][room].replace("|", "\\|")
                lines.append(f"| `{_short(room, package)}` | {says} | {below or '–'} |")
        lines.append("")
    return "\n".join(lines).rstrip()


def _short(room: str, package: str) -> str:
    return room.removeprefix(f"{package}.")


def with_table(page: str, data: Data) -> str:
    """The page with its table as the data have it.

    Raises:
        ValueError: the page has not the two markers.
    """
    before, begin, rest = page.partition(BEGIN)
    _, end, after = rest.partition(END)
    if not begin or not end:
        raise ValueError(f"{PAGE}: the markers {BEGIN} and {END} are missing. Put them back.")
    return f"{before}{begin}\n{table(data)}\n{end}{after}"


def as_text(data: Data) -> str:
    """The data as the file has them."""
    return json.dumps(data, indent=1, ensure_ascii=False, sort_keys=True) + "\n"


def main() -> None:
    """Write data, picture and table."""
    argparse.ArgumentParser(description=__doc__).parse_args()
    data = gather()
    DATA.write_text(as_text(data), encoding="utf-8")
    PAGE.write_text(with_table(PAGE.read_text(encoding="utf-8"), data), encoding="utf-8")
    print(draw(data, DATA.with_suffix(".svg")))


if __name__ == "__main__":
    main()
