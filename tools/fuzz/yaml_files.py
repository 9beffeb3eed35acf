"""Target: every kind of YAML file that a person may write, from text to model."""

import random
from collections.abc import Callable
from pathlib import Path
from typing import Any

import yaml

from companion.config.base import Section
from companion.config.models import ControllerConfig, MissionConfig, VehicleConfig
from companion.config.validation import validate
from companion.config.yaml_source import ConfigError, parse_yaml
from companion.experiments.faults.table import FaultTable
from sitl_shim.data_file import DataFileError, DataModel, parse_data
from sitl_shim.faults.schema import Faults
from sitl_shim.plant.vehicle import VehicleModel
from sitl_shim.sensors.profile import SensorProfile
from sitl_shim.wind.scenario import Scenario
from tools.fuzz.target import FindingError
from tools.fuzz.texts import varied

_NAME = "fuzzed.yaml"
_LONGEST = 60_000


def _of_companion(model: type[Section]) -> Callable[[str], None]:
    def read(text: str) -> None:
        try:
            validate(model, parse_yaml(text, _NAME))
        except ConfigError as error:
            _check_told(str(error))

    return read


def _of_shim(model: type[DataModel]) -> Callable[[str], None]:
    def read(text: str) -> None:
        try:
            parse_data(text, model, _NAME)
        except DataFileError as error:
            _check_told(str(error))

    return read


def _check_told(text: str) -> None:
    """An error names the file, in each of its sentences' lines, and is no essay."""
    if not text.startswith(_NAME):
        raise FindingError(f"an error does not say where: {text[:300]}")
    if len(text) > 100_000:
        raise FindingError(f"an error has {len(text)} characters: {text[:300]}")


class YamlFiles:
    """See the module."""

    unit = "documents"

    def __init__(self, root: Path) -> None:
        """Prepare.

        Args:
            root: of the repository, for the shipped files.
        """
        configs, shim = root / "configs", root / "sitl_shim"
        kinds: list[tuple[Callable[[str], None], list[Path]]] = [
            (_of_companion(MissionConfig), sorted((configs / "missions").glob("*.yaml"))),
            (_of_companion(VehicleConfig), sorted((configs / "vehicles").glob("*.yaml"))),
            (_of_companion(ControllerConfig), sorted((configs / "controllers").glob("*/*.yaml"))),
            (_of_companion(FaultTable), [configs / "fault-table.yaml"]),
            (_of_shim(Scenario), sorted((configs / "scenarios").glob("*.yaml"))),
            (_of_shim(Faults), sorted((configs / "faults").glob("*.yaml"))),
            (_of_shim(VehicleModel), sorted((shim / "plant" / "vehicles").glob("*.yaml"))),
            (_of_shim(SensorProfile), sorted((shim / "sensors" / "profiles").glob("*.yaml"))),
        ]
        self._read = [read for read, _ in kinds]
        self._shipped: list[list[dict[str, Any]]] = [
            [yaml.safe_load(path.read_text(encoding="utf-8")) for path in paths]
            for _, paths in kinds
        ]
        for read, documents in zip(self._read, self._shipped, strict=True):
            for document in documents:
                read(yaml.safe_dump(document))
        self._words = sorted(
            {word for docs in self._shipped for doc in docs for word in _keys(doc)}
        )

    def generate(self, rng: random.Random) -> bytes:
        """A shipped file or a part of it, varied."""
        kind = rng.randrange(len(self._read))
        document = rng.choice(self._shipped[kind])
        if rng.random() < 0.6:
            kept = rng.sample(sorted(document), min(len(document), rng.randrange(1, 5)))
            document = {key: document[key] for key in kept}
        document = {key: _some(value, rng) for key, value in document.items()}
        text = yaml.dump(document, Dumper=_Dumper, default_flow_style=rng.choice((None, False)))
        return bytes((kind,)) + _encoded(varied(text, rng, self._words))

    def mutate(self, data: bytes, rng: random.Random) -> bytes:
        """The same kind of file, varied once more."""
        return data[:1] + _encoded(varied(_decoded(data[1:]), rng, self._words))

    def pieces(self, data: bytes) -> list[bytes]:
        """The kind, and lines."""
        return [data[:1], *data[1:].splitlines(keepends=True)]

    def join(self, pieces: list[bytes]) -> bytes:
        """The input of these."""
        return b"".join(pieces)

    def run(self, data: bytes) -> int:
        """Read one file."""
        if data:
            self._read[data[0] % len(self._read)](_decoded(data[1:])[:_LONGEST])
        return 1


_Dumper = yaml.CSafeDumper if yaml.__with_libyaml__ else yaml.SafeDumper


def _some(value: object, rng: random.Random) -> object:
    """A long list shortened: small documents are read in less time."""
    return rng.sample(value, 2) if isinstance(value, list) and len(value) > 6 else value


def _keys(value: object) -> list[str]:
    if isinstance(value, dict):
        return [str(key) for key in value] + [k for v in value.values() for k in _keys(v)]
    if isinstance(value, list):
        return [key for item in value for key in _keys(item)]
    return [value] if isinstance(value, str) and value.isidentifier() else []


def _encoded(text: str) -> bytes:
    return text.encode("utf-8", errors="surrogatepass")


def _decoded(data: bytes) -> str:
    try:
        return data.decode("utf-8", errors="surrogatepass")
    except UnicodeDecodeError:
        return data.decode("utf-8", errors="replace")
