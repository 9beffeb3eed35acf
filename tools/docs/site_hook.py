"""What the site needs beyond MkDocs; mkdocs.yml names it as a hook.

- The documents at the repository's root (CONTRIBUTING.md and so on) are pages, too.
- Documents link to code, as a forge shows it: each file and folder that one links to gets a page of
  its own, so that the site is whole without a forge, and links to it are checked like all others.
- An entry of the navigation that ends in a slash stands for all pages of that folder.
- A heading's anchor is the one that a forge makes; a list needs no empty line before it.

It stands by itself: MkDocs loads it by its path.
"""

import posixpath
import re
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any
from urllib.parse import unquote

from mkdocs.config.defaults import MkDocsConfig
from mkdocs.structure.files import File, Files
from mkdocs.structure.pages import Page

ROOT = Path(__file__).parents[2]
ROOT_PAGES = {
    "CONTRIBUTING.md": "contributing.md",
    "CHANGELOG.md": "changelog.md",
    "SECURITY.md": "security.md",
    "README.md": "readme.md",
}
"""Documents at the root, and where the site has them."""
SOURCE = "source"
"""Folder of the site that holds the pages of files."""

_FENCE = re.compile(r"^ {0,3}(```+|~~~+).*?^ {0,3}\1 *$", re.MULTILINE | re.DOTALL)
_CODE_SPAN = re.compile(r"(?<!`)(`+)(?!`)(.+?)(?<!`)\1(?!`)", re.DOTALL)
_TARGET = re.compile(r"(?<=\]\()<?([^()\s>]+)>?(?=(?:\s+\"[^\"]*\")?\s*\))")
_EXTERNAL = re.compile(r"[a-z][a-z0-9+.-]*:|#", re.IGNORECASE)
_ITEM = re.compile(r"(?:[-*+]|1\.) ")
_ANY_ITEM = re.compile(r"\s*(?:[-*+]|\d+\.) ")
_LARGEST_BYTES = 200_000
_TEXT = {".py", ".yaml", ".yml", ".toml", ".json", ".csv", ".md", ".service", ".sh", ".ipynb", ""}
_LANGUAGES = {".py": "python", ".yaml": "yaml", ".yml": "yaml", ".toml": "toml", ".json": "json",
              ".service": "ini", ".sh": "bash"}  # fmt: skip


def on_config(config: MkDocsConfig) -> MkDocsConfig:
    """Fill in the navigation's folders, and set the anchors."""
    if config.nav is not None:
        config.nav = [_filled(entry, Path(config.docs_dir)) for entry in config.nav]
    config.mdx_configs.setdefault("toc", {})["slugify"] = anchor
    return config


def on_files(files: Files, config: MkDocsConfig) -> Files:
    """Add the root's documents, and a page for each file or folder that is linked to."""
    for name, uri in ROOT_PAGES.items():
        if (ROOT / name).is_file():
            text = (ROOT / name).read_text(encoding="utf-8")
            files.append(File.generated(config, uri, content=_at_home(text)))
    for path in sorted(_with_contents(_linked(Path(config.docs_dir)))):
        uri = _source_uri(path)
        if files.get_file_from_path(uri) is None:
            files.append(File.generated(config, uri, content=_source_page(path)))
    return files


def on_page_markdown(markdown: str, page: Page, config: MkDocsConfig, files: Files) -> str:
    """Lead links to where the site has what they mean."""
    uri = page.file.src_uri
    if uri.startswith(f"{SOURCE}/"):
        return markdown
    return _prose(markdown, lambda text: _spaced(_TARGET.sub(lambda m: _led(m[1], uri), text)))


def anchor(heading: str, separator: str) -> str:
    """The anchor that a forge makes of a heading's text."""
    kept = re.sub(r"[^\w\- ]", "", heading.strip().lower())
    return kept.replace(" ", separator)


def _filled(entry: Any, docs: Path) -> Any:  # noqa: ANN401 - as YAML has it
    if isinstance(entry, dict):
        return {title: _filled(inner, docs) for title, inner in entry.items()}
    if isinstance(entry, list):
        return [_filled(inner, docs) for inner in entry]
    if isinstance(entry, str) and entry.endswith("/"):
        pages = sorted((docs / entry).rglob("*.md"), key=_index_first)
        return [page.relative_to(docs).as_posix() for page in pages]
    return entry


def _index_first(page: Path) -> tuple[int, str]:
    return (0 if page.name in ("README.md", "index.md") else 1, page.as_posix())


def _at_home(text: str) -> str:
    """A document of the root with its links as those of a page in docs/."""

    def moved(match: re.Match[str]) -> str:
        target = match[1]
        if _EXTERNAL.match(target):
            return target
        return target.removeprefix("docs/") if target.startswith("docs/") else f"../{target}"

    return _prose(text, lambda prose: _TARGET.sub(moved, prose))


def _prose(markdown: str, change: Callable[[str], str]) -> str:
    """Markdown whose text outside of fences and code spans was changed."""
    kept: list[str] = []

    def hide(match: re.Match[str]) -> str:
        kept.append(match.group())
        return f"\x00{len(kept) - 1}\x00"

    hidden = _CODE_SPAN.sub(hide, _FENCE.sub(hide, markdown))
    changed = change(hidden)
    while "\x00" in changed:
        changed = re.sub(r"\x00(\d+)\x00", lambda m: kept[int(m[1])], changed)
    return changed


def _spaced(prose: str) -> str:
    """An empty line before each list, without which Python-Markdown takes it for text."""
    lines: list[str] = []
    for line in prose.split("\n"):
        before = lines[-1] if lines else ""
        if (
            _ITEM.match(line)
            and before.strip()
            and not _ANY_ITEM.match(before)
            and before[0] != " "
        ):
            lines.append("")
        lines.append(line)
    return "\n".join(lines)


def _led(target: str, uri: str) -> str:
    """A link's target on the site."""
    if _EXTERNAL.match(target):
        return target
    place, _, fragment = target.partition("#")
    full = posixpath.normpath(posixpath.join("docs", posixpath.dirname(uri), unquote(place)))
    if full.startswith("docs/"):
        inside = full.removeprefix("docs/")
        if not (ROOT / full).is_dir():
            return target
        at = next(
            (f"{inside}/{n}" for n in ("README.md", "index.md") if (ROOT / full / n).is_file()), ""
        )
    else:
        at = ROOT_PAGES.get(full) or _source_uri(full)
        fragment = fragment if full in ROOT_PAGES else ""
    return posixpath.relpath(at, posixpath.dirname(uri) or ".") + (
        f"#{fragment}" if fragment else ""
    )


def _linked(docs: Path) -> Iterator[str]:
    """Paths in the repository, outside of docs/, that its documents link to."""
    documents = [*docs.rglob("*.md"), *(ROOT / name for name in ROOT_PAGES)]
    seen: set[str] = set()
    for document in documents:
        home = document.parent.relative_to(ROOT).as_posix()
        found = _prose_targets(document.read_text(encoding="utf-8"))
        for target in found:
            place = unquote(target.partition("#")[0])
            full = posixpath.normpath(posixpath.join(home, place))
            outside = not full.startswith(("docs/", "..")) and full not in ("docs", ".")
            if outside and full not in ROOT_PAGES and (ROOT / full).exists() and full not in seen:
                seen.add(full)
                yield full


def _with_contents(paths: Iterator[str]) -> set[str]:
    """Those paths, and the files that lie directly in those of them that are folders."""
    found = set(paths)
    for path in list(found):
        if (ROOT / path).is_dir():
            found |= {f"{path}/{name}" for name in _shown(ROOT / path) if not name.endswith("/")}
    return found


def _shown(folder: Path) -> list[str]:
    """What a folder holds that a reader wants to see; folders in it end in a slash."""
    names = sorted(p.name + ("/" if p.is_dir() else "") for p in folder.iterdir())
    return [name for name in names if not name.startswith(("__pycache__", "."))]


def _prose_targets(markdown: str) -> list[str]:
    found: list[str] = []
    _prose(markdown, lambda text: (found.extend(m[1] for m in _TARGET.finditer(text)), text)[1])
    return [target for target in found if not _EXTERNAL.match(target)]


def _source_uri(path: str) -> str:
    return f"{SOURCE}/{path}/index.md" if (ROOT / path).is_dir() else f"{SOURCE}/{path}.md"


def _source_page(path: str) -> str:
    """A file's text, or what a folder holds; not for the search."""
    head = f"---\ntitle: {path}\nsearch:\n  exclude: true\nhide:\n  - toc\n---\n\n# `{path}`\n\n"
    full = ROOT / path
    if full.is_dir():
        lines = [
            f"- `{name}`" if name.endswith("/") else f"- [`{name}`]({name}.md)"
            for name in _shown(full)
        ]
        return head + "\n".join(lines) + "\n"
    if full.suffix not in _TEXT or full.stat().st_size > _LARGEST_BYTES:
        return head + "See the repository.\n"
    fence = "`" * 8
    text = full.read_text(encoding="utf-8")
    return f"{head}{fence}{_LANGUAGES.get(full.suffix, 'text')}\n{text}\n{fence}\n"
