"""The commands that README and docs show, read out of them."""

import re
import shlex
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).parent.parent.parent
DOCUMENTS = (
    ROOT / "README.md",
    ROOT / "CONTRIBUTING.md",
    *sorted((ROOT / "docs").rglob("*.md")),
    *sorted((ROOT / "examples").rglob("*.md")),
    *sorted((ROOT / "deploy").rglob("*.md")),
)
PROGRAMS = ("companion", "sitl-shim", "python")
"""Of which every command in a document has to be one that works."""
_SUBSHELL = "(umask "
"""How a line begins that makes a key's file; a later command reads it."""

_FENCE = re.compile(r"^(?P<indent> *)(?P<fence>```+)(?P<language>[\w-]*).*$")
_SHOWN_FILE = re.compile(
    r"^```+yaml\n(?P<text># (?P<name>[\w-]+\.yaml)\b.*?)^```+$", re.MULTILINE | re.DOTALL
)
_LANGUAGES = ("", "sh", "bash", "console")
"""Of blocks that hold commands; others hold output, YAML and so on."""
_PLACEHOLDER = re.compile(r"(^|[=/@:.])(?!N$)[A-Z][A-Z]+([/@:.]|$)|…|\.\.\.|\[-")


@dataclass(frozen=True, slots=True)
class Command:
    """A command of a document."""

    document: Path
    line: int
    text: str
    """As written, without the prompt and the comment behind it."""
    argv: tuple[str, ...]

    @property
    def program(self) -> str:
        return self.argv[0]

    @property
    def where(self) -> str:
        """Document and line, for a person."""
        return f"{self.document.relative_to(ROOT)}:{self.line}"

    @property
    def has_placeholder(self) -> bool:
        """It shows a form (FILE.yaml, HOST, flights/…), not a command that can be typed."""
        return any(_PLACEHOLDER.search(word) for word in self.argv[1:])


def commands_of(document: Path) -> list[Command]:
    """All commands of a document, in order, that begin with one of the programs."""
    return [
        command
        for line, text in _lines_of_blocks(document.read_text(encoding="utf-8"))
        if (command := _command(document, line, text)) is not None
    ]


def files_of(document: Path) -> dict[str, str]:
    """The YAML files that a document shows whole, by name: the block's first line says it."""
    text = document.read_text(encoding="utf-8")
    return {match["name"]: match["text"] for match in _SHOWN_FILE.finditer(text)}


def _command(document: Path, line: int, text: str) -> Command | None:
    if text.startswith(_SUBSHELL):
        return Command(document, line, text, ("bash", "-c", text))
    words = _words(text.removeprefix("$ "))
    # "python3 -m venv .venv && .venv/bin/pip install ." is the set-up, which `.ci/run` does.
    if not words or words[0] not in PROGRAMS or "&&" in words:
        return None
    return Command(document, line, shlex.join(words), tuple(words))


def _words(text: str) -> list[str]:
    try:
        return shlex.split(text, comments=True)
    except ValueError:
        return []


def _lines_of_blocks(text: str) -> list[tuple[int, str]]:
    """(number, line) of all lines in blocks of commands; continued ones are joined."""
    found: list[tuple[int, str]] = []
    fence, language, continued = "", "", False
    for number, line in enumerate(text.splitlines(), 1):
        match = _FENCE.match(line)
        if match and (not fence or line.strip() == fence):
            fence = "" if fence else match["fence"]
            language, continued = match["language"], False
            continue
        if not fence or language not in _LANGUAGES:
            continue
        stripped = line.strip()
        if continued:
            first, begun = found[-1]
            found[-1] = (first, f"{begun} {stripped.removesuffix(chr(92))}")
        else:
            found.append((number, stripped.removesuffix("\\")))
        continued = stripped.endswith("\\")
    return found
