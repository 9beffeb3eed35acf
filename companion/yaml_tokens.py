"""What YAML text is looked through for before values are made of it.

A few lines of text can name a tree without end; looking at the tokens takes no more memory than
the text does.
"""

from typing import Any, Literal, NamedTuple

import yaml

PARSE_ERRORS = (
    yaml.YAMLError,
    ValueError,
    LookupError,
    AttributeError,
    TypeError,
    ArithmeticError,
    RecursionError,
)
"""What PyYAML raises for text that it can't turn into values: apart from its own errors, tags such
as ``!!int ""``, ``!!bool x`` and ``!!timestamp x`` fail deep inside its constructors."""

FAST_LOADER: Any = yaml.CSafeLoader if yaml.__with_libyaml__ else yaml.SafeLoader
"""On libyaml, which is ten times as fast, and vaguer about what is wrong."""

_OPENING = (
    yaml.BlockMappingStartToken,
    yaml.BlockSequenceStartToken,
    yaml.FlowMappingStartToken,
    yaml.FlowSequenceStartToken,
)
_CLOSING = (yaml.BlockEndToken, yaml.FlowMappingEndToken, yaml.FlowSequenceEndToken)


class Flaw(NamedTuple):
    """Why no values are made of a text."""

    kind: Literal["alias", "depth"]
    line: int
    """From 1."""


def find_flaw(text: str, loader: Any, deepest: int) -> Flaw | None:  # noqa: ANN401 - PyYAML's
    """The first alias, or the first place that nests too deeply; None for a harmless text.

    Args:
        text: YAML.
        loader: a class of PyYAML's.
        deepest: levels of nesting that are taken.

    Raises:
        yaml.YAMLError: the text is not YAML.
    """
    depth = 0
    for token in yaml.scan(text, Loader=loader):
        if isinstance(token, yaml.AliasToken):
            return Flaw("alias", token.start_mark.line + 1)
        depth += isinstance(token, _OPENING) - isinstance(token, _CLOSING)
        if depth > deepest:
            return Flaw("depth", token.start_mark.line + 1)
    return None
