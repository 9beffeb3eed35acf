"""Writing a controller's YAML file as a person would: a line a key, lists in brackets."""

import textwrap
from collections.abc import Mapping
from typing import Any

import yaml

from companion.recording.whole_file import write_whole

__all__ = ["controller_yaml", "write_whole"]

_WIDTH = 98


def controller_yaml(remark: str, data: Mapping[str, Any]) -> str:
    """The text of a controller's file.

    Args:
        remark: the comment at its top, one line.
        data: its keys; `source` is folded, the others are sections or values.
    """
    lines = [f"# {remark}"]
    for key, value in data.items():
        if value is None:
            continue
        if key == "source":
            lines += ["source: >-", *_folded(str(value))]
        elif isinstance(value, Mapping):
            lines.append(f"{key}:")
            lines += [
                f"  {name}: {_flow(inner)}" for name, inner in value.items() if inner is not None
            ]
        else:
            lines.append(f"{key}: {_flow(value)}")
    return "\n".join(lines) + "\n"


def _folded(text: str) -> list[str]:
    return textwrap.wrap(
        text,
        _WIDTH,
        initial_indent="  ",
        subsequent_indent="  ",
        break_long_words=False,
        break_on_hyphens=False,
    )


def _flow(value: Any) -> str:  # noqa: ANN401 - any value of a controller's file
    if isinstance(value, list | tuple):
        return "[" + ", ".join(_flow(item) for item in value) + "]"
    text: str = yaml.safe_dump(value, default_flow_style=True, width=10_000, allow_unicode=True)
    return text.removesuffix("\n").removesuffix("\n...")
