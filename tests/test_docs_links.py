"""Links between the documents, and from them to code, lead somewhere."""

import ast
import re
from functools import cache
from pathlib import Path
from urllib.parse import unquote

import pytest

ROOT = Path(__file__).parent.parent
DOCUMENTS = [*sorted(ROOT.glob("*.md")), *sorted((ROOT / "docs").rglob("*.md"))]

FENCE = re.compile(r"^ {0,3}(```+|~~~+).*?^ {0,3}\1 *$", re.MULTILINE | re.DOTALL)
CODE_SPAN = re.compile(r"(`+)(.+?)\1")
LINK = re.compile(r"\[((?:[^\[\]]|\[[^\]]*\])*)\]\(\s*<?([^()\s>]+)>?(?:\s+\"[^\"]*\")?\s*\)")
REFERENCE = re.compile(r"^ {0,3}\[([^\]]+)\]:\s*<?([^\s>]+)", re.MULTILINE)
HEADING = re.compile(r"^ {0,3}#{1,6}\s+(.+?)(?:\s+#+)?\s*$", re.MULTILINE)
EXTERNAL = re.compile(r"[a-z][a-z0-9+.-]*:", re.IGNORECASE)
NAME_OF_CODE = re.compile(r"`([A-Za-z_]\w*(?:\.[A-Za-z_]\w*)*)`")


def links_of(text):
    """(text, target) of each link that a forge would make of a document."""
    prose = FENCE.sub("", text)
    # The target of a link is never in a code span, but its text may be one.
    hidden = CODE_SPAN.sub(lambda m: m.group().replace("](", "] ("), prose)
    return [(m[1], m[2]) for m in LINK.finditer(hidden)] + REFERENCE.findall(hidden)


def slug(heading):
    """The anchor that a forge makes of a heading."""
    shown = LINK.sub(lambda m: m[1], heading).replace("`", "")
    kept = re.sub(r"[^\w\- ]", "", shown.strip().lower())
    return kept.replace(" ", "-")


@cache
def anchors(path):
    """All anchors of a document; a heading that comes again gets a number."""
    found = {}
    for heading in HEADING.findall(FENCE.sub("", path.read_text(encoding="utf-8"))):
        base = slug(heading)
        found[base] = found.get(base, -1) + 1
        if found[base]:
            found[f"{base}-{found[base]}"] = 0
    return frozenset(found)


@cache
def names_defined_in(path):
    """Functions, classes, and what a module or a class gives a name to."""
    found = set()
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef | ast.ClassDef):
            found.add(node.name)
        if isinstance(node, ast.Module | ast.ClassDef):
            for inner in node.body:
                targets = getattr(inner, "targets", [getattr(inner, "target", None)])
                found.update(t.id for t in targets if isinstance(t, ast.Name))
    return frozenset(found)


def fault_of(text, target, document):
    """What is wrong with a link inside the repository; None if nothing is.

    A link to code may have as its text what is in that file: `function`, `module.function`.
    """
    place, _, anchor = unquote(target).partition("#")
    path = (document.parent / place).resolve() if place else document
    if not path.is_relative_to(ROOT) or place.startswith("/"):
        return "leaves the repository"
    if not path.exists():
        return "no such file"
    if anchor and path.suffix == ".md" and anchor not in anchors(path):
        return "no such heading"
    named = NAME_OF_CODE.fullmatch(text)
    if path.suffix == ".py" and named and not named[1].endswith(".py"):
        name = named[1].rpartition(".")[2]
        if name != path.stem and name not in names_defined_in(path):
            return "no such name in that file"
    return None


@pytest.mark.parametrize("document", DOCUMENTS, ids=lambda path: str(path.relative_to(ROOT)))
def test_links_inside_the_repository_lead_somewhere(document):
    links = links_of(document.read_text(encoding="utf-8"))
    inside = [(text, target) for text, target in links if not EXTERNAL.match(target)]
    faults = {target: fault_of(text, target, document) for text, target in inside}
    assert {target: fault for target, fault in faults.items() if fault} == {}


@pytest.mark.parametrize(
    ("written", "fault"),
    [
        ("[a](nothing.md)", "no such file"),
        ("![a](<images/nothing.png>)", "no such file"),
        ("[a]: nothing.md", "no such file"),
        ("[a](glossary.md#nothing-of-the-kind)", "no such heading"),
        ("[a](#nothing-of-the-kind)", "no such heading"),
        ("[a](../../elsewhere.md)", "leaves the repository"),
        ("[`mpc.nothing`](../companion/control/mpc.py)", "no such name in that file"),
        ("[`mpc.Mpc`](../companion/control/mpc.py)", None),
        ("[`MpcSettings.horizon`](../companion/control/mpc.py)", None),
        ("[`mpc.py`](../companion/control/mpc.py)", None),
        ("[a [b] c](glossary.md)", None),
        ("[a](decisions/)", None),
    ],
)
def test_what_leads_nowhere_is_found(written, fault):
    [(text, target)] = links_of(written)
    assert fault_of(text, target, ROOT / "docs" / "glossary.md") == fault


def test_what_stands_in_code_is_no_link():
    text = "[a](b.md)\n```\n[c](nothing.md)\n```\n`[d](nothing.md)` and [`e`](f.py)"
    assert [target for _, target in links_of(text)] == ["b.md", "f.py"]


@pytest.mark.parametrize(
    ("heading", "anchor"),
    [
        ("Where the text is silent", "where-the-text-is-silent"),
        ("L1: the `step`, and (Γ)", "l1-the-step-and-γ"),
        ("1. Soft bounds – and more", "1-soft-bounds--and-more"),
        ("See [the glossary](glossary.md)", "see-the-glossary"),
    ],
)
def test_anchors_are_those_of_a_forge(heading, anchor):
    assert slug(heading) == anchor
