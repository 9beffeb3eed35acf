"""Parameters of an autopilot: definitions, values, order, hash.  No flavour, no wire format."""

import math
import struct
import zlib
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from enum import IntEnum


class ParameterType(IntEnum):
    """Types of parameters, with the numbers of MAVLink's MAV_PARAM_TYPE."""

    INT32 = 6
    REAL32 = 9


@dataclass(frozen=True, slots=True)
class ParameterDefinition:
    """One parameter: its name, type, default and the range in which it makes sense."""

    name: str
    type: ParameterType
    default: float
    minimum: float
    maximum: float
    meaning: str
    """What it does, with its unit."""


class ParameterError(ValueError):
    """A parameter that does not exist, or a value that it does not take."""


class UnknownParameterError(ParameterError):
    """No parameter has this name."""


class ParameterRangeError(ParameterError):
    """The value is outside of the parameter's range, or not finite."""


class ParameterStore:
    """Values of a fixed set of parameters, sorted by name.

    Args:
        definitions: the parameters that exist.
        overrides: values that differ from the defaults, by name.

    Raises:
        ParameterError: an override that does not exist or is out of range.
    """

    def __init__(
        self, definitions: Iterable[ParameterDefinition], overrides: Mapping[str, float]
    ) -> None:
        ordered = sorted(definitions, key=lambda definition: definition.name)
        self._definitions = {definition.name: definition for definition in ordered}
        self._values = {definition.name: float(definition.default) for definition in ordered}
        self.names: tuple[str, ...] = tuple(self._values)
        self._index = {name: index for index, name in enumerate(self.names)}
        self.revision = 0
        """Grows with every change, so that who caches values knows when to read them again."""
        for name, value in overrides.items():
            self.set(name, value)

    def __len__(self) -> int:
        return len(self.names)

    def __contains__(self, name: object) -> bool:
        return name in self._values

    def __getitem__(self, name: str) -> float:
        return self._values[name]

    def integer(self, name: str) -> int:
        """Value of an integer parameter."""
        return int(self._values[name])

    def index(self, name: str) -> int:
        """Place of a parameter in the sorted list."""
        return self._index[name]

    def definition(self, name: str) -> ParameterDefinition:
        """Definition of a parameter.

        Raises:
            UnknownParameterError: there is none of this name.
        """
        try:
            return self._definitions[name]
        except KeyError:
            raise UnknownParameterError(f"there is no parameter {name}") from None

    def set(self, name: str, value: float) -> None:
        """Change a value.

        Raises:
            UnknownParameterError: there is no parameter of this name.
            ParameterRangeError: the value is out of range, not finite, or not whole though the
                parameter is an integer.
        """
        definition = self.definition(name)
        fits = math.isfinite(value) and definition.minimum <= value <= definition.maximum
        if not fits or (definition.type is ParameterType.INT32 and value != int(value)):
            raise ParameterRangeError(
                f"{name} takes {definition.minimum:g} to {definition.maximum:g}"
                f" ({definition.type.name.lower()}), not {value:g}"
            )
        self._values[name] = float(value)
        self.revision += 1

    def learn(self, name: str, value: float) -> None:
        """Take a value that the autopilot has found out itself, which is no change to it.

        Raises:
            UnknownParameterError: there is no parameter of this name.
        """
        self.definition(name)
        self._values[name] = value

    def hash(self) -> int:
        """A 32-bit hash over names and values: equal hashes mean an unchanged list."""
        crc = 0
        for name, value in self._values.items():
            crc = zlib.crc32(name.encode(), crc)
            if self._definitions[name].type is ParameterType.INT32:
                crc = zlib.crc32(struct.pack("<i", int(value)), crc)
            else:
                crc = zlib.crc32(struct.pack("<f", value), crc)
        return crc
