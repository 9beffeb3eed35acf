"""Fetches the two libraries of the live page, so that the page works offline.

    python -m tools.vendor_web          fetch, check, write
    python -m tools.vendor_web --check  do the files still have the sums of the manifest?

The packages come through `npm pack` at the versions below; each archive must have the SHA-256 that
stands here.  Of each, only the files named are kept, beside their licence.  `manifest.json` beside
them has the SHA-256 of every file as written.

The page's Content-Security-Policy allows no inline import map, so in the modules of three.js that
import from the bare name `three`, that name becomes the path of the file beside them: the one
change that is made.
"""

import argparse
import hashlib
import json
import shutil
import subprocess
import sys
import tarfile
import tempfile
from dataclasses import dataclass
from pathlib import Path

VENDOR = Path(__file__).resolve().parent.parent / "companion" / "live" / "static" / "vendor"
MANIFEST = "manifest.json"


@dataclass(frozen=True, slots=True)
class Package:
    """What is taken of a package."""

    name: str
    version: str
    sha256: str
    """Of the archive."""
    licence: str
    files: tuple[str, ...]
    """Inside the archive; written flat, by their last name."""
    replace: tuple[str, str] | None = None
    """A text in the files and what takes its place."""


PACKAGES = (
    Package(
        "uplot",
        "1.6.32",
        "4b8a8191e425658e3ea8c8c1314b0fc679c861ee3a1af2b20c7b16ba50b5133d",
        "MIT",
        ("LICENSE", "dist/uPlot.iife.min.js", "dist/uPlot.min.css"),
    ),
    Package(
        "three",
        "0.184.0",
        "5c8c75278504ff31cedcd736e043b06c18f2cbf220ad7f85fbfaa1a08d3b3626",
        "MIT",
        (
            "LICENSE",
            "build/three.core.min.js",
            "build/three.module.min.js",
            "examples/jsm/controls/OrbitControls.js",
            "examples/jsm/lines/Line2.js",
            "examples/jsm/lines/LineGeometry.js",
            "examples/jsm/lines/LineMaterial.js",
            "examples/jsm/lines/LineSegments2.js",
            "examples/jsm/lines/LineSegmentsGeometry.js",
        ),
        ("} from 'three';", "} from './three.module.min.js';"),
    ),
)


class VendorError(Exception):
    """Something is not what it should be; the text says what and the remedy."""


def sha256(content: bytes) -> str:
    """SHA-256 in hexadecimal."""
    return hashlib.sha256(content).hexdigest()


def fetch(package: Package, folder: Path) -> bytes:
    """The package's archive.

    Raises:
        VendorError: npm is missing or fails, or the archive has another sum.
    """
    npm = shutil.which("npm")
    if npm is None:
        raise VendorError("npm is not installed; it comes with Node.js.")
    name = f"{package.name}@{package.version}"
    done = subprocess.run(
        [npm, "pack", "--silent", name], cwd=folder, capture_output=True, text=True, check=False
    )
    if done.returncode != 0:
        raise VendorError(f"npm pack {name}: {done.stderr.strip()}")
    content = (folder / done.stdout.split()[-1]).read_bytes()
    if sha256(content) != package.sha256:
        raise VendorError(f"{name} has the SHA-256 {sha256(content)}, not {package.sha256}.")
    return content


def unpack(package: Package, archive: Path) -> dict[str, bytes]:
    """The kept files by the names that they get."""
    kept = {}
    with tarfile.open(archive) as tar:
        for path in package.files:
            member = tar.extractfile(f"package/{path}")
            if member is None:
                raise VendorError(f"{package.name} has no file {path}.")
            content = member.read()
            if package.replace is not None:
                old, new = (text.encode() for text in package.replace)
                content = content.replace(old, new)
            kept[path.rsplit("/", 1)[-1]] = content
    return kept


def write(vendor: Path = VENDOR) -> None:
    """Fetch every package and write its files and the manifest."""
    manifest = {}
    for package in PACKAGES:
        with tempfile.TemporaryDirectory() as name:
            archive = Path(name) / "archive.tgz"
            archive.write_bytes(fetch(package, Path(name)))
            files = unpack(package, archive)
        folder = vendor / package.name
        shutil.rmtree(folder, ignore_errors=True)
        folder.mkdir(parents=True)
        for file, content in files.items():
            (folder / file).write_bytes(content)
        manifest[package.name] = {
            "version": package.version,
            "licence": package.licence,
            "archive_sha256": package.sha256,
            "files": {file: sha256(content) for file, content in sorted(files.items())},
        }
    (vendor / MANIFEST).write_text(json.dumps(manifest, indent=2) + "\n")


def differences(vendor: Path = VENDOR) -> list[str]:
    """How the files differ from the manifest and from the versions here; empty if not at all."""
    manifest = json.loads((vendor / MANIFEST).read_text())
    found = []
    for package in PACKAGES:
        entry = manifest.get(package.name, {"version": "none", "files": {}})
        if (entry["version"], entry.get("archive_sha256")) != (package.version, package.sha256):
            found.append(f"{package.name}: the manifest is of version {entry['version']}")
        folder = vendor / package.name
        there = {path.name for path in folder.iterdir()} if folder.is_dir() else set()
        found += [
            f"{package.name}/{name}: not in the manifest" for name in there - {*entry["files"]}
        ]
        for name, expected in entry["files"].items():
            if name not in there:
                found.append(f"{package.name}/{name}: missing")
            elif sha256((folder / name).read_bytes()) != expected:
                found.append(f"{package.name}/{name}: changed")
    strangers = {path.name for path in vendor.iterdir()} - {*manifest, MANIFEST}
    return sorted([*found, *(f"{name}: not in the manifest" for name in strangers)])


def main() -> int:
    """Write or check."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--check", action="store_true", help="compare only, write nothing")
    if not parser.parse_args().check:
        try:
            write()
        except VendorError as error:
            print(error, file=sys.stderr)
            return 1
    found = differences()
    print("\n".join(found) or "The vendored files are those of the manifest.")
    return 1 if found else 0


if __name__ == "__main__":
    raise SystemExit(main())
