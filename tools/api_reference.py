"""The reference of the library's public names, made of their docstrings: docs/api/reference.md.

``python -m tools.api_reference`` writes it; a test holds it to the code.  Nothing is imported but
`companion.api`: signatures and the docstrings below fields are read from the sources.
"""

import ast
import inspect
import re
import sys
from collections.abc import Iterator
from pathlib import Path
from types import ModuleType

from companion import api

PAGE = Path(__file__).parents[1] / "docs" / "api" / "reference.md"

GROUPS: dict[str, tuple[str, ...]] = {
    "Flying": ("fly", "read_flight", "score", "Flight", "Figures", "Ticks", "Truth"),
    "Controllers": (
        "Controller",
        "ControlSample",
        "VehicleState",
        "Preview",
        "DesiredMotion",
        "Setpoint",
        "AccelerationSetpoint",
        "AttitudeSetpoint",
    ),
    "Trajectories": ("Trajectory", "Motion", "make_trajectory", "FunctionTrajectory"),
    "Winds": ("Wind",),
    "Vehicles": ("vehicle_of", "plant_of", "write_yaml"),
    "Errors": ("InputError", "ControllerError"),
}
"""Every public name, in the order in which it is explained."""

_HEAD = """\
# Every public name

What `companion.api` offers, made of its docstrings by `python -m tools.api_reference`. What is
stable about it says [the overview](index.md#what-is-stable). Worlds are ENU (east, north, up),
bodies FLU (forward, left, up), quaternions (w, x, y, z) from body to world; units are in the names.
An `Array` is a numpy array of floats, a `Vector3` a tuple of three, a `Quaternion` one of four; a
`Reference` gives positions (samples, 3) for times (samples,), and an `Along` three numbers for one
time.
"""
_SECTIONS = {"Args:": "Arguments", "Returns:": "Returns", "Raises:": "Raises"}
_ITEM = re.compile(r"^    (\*{0,2}\w+): (.*)$")
_ROLE = re.compile(r"``([^`]+)``")

_Definition = ast.FunctionDef | ast.ClassDef | ast.Assign


def page() -> str:
    """The page's text."""
    parts = [_HEAD]
    for title, names in GROUPS.items():
        parts.append(f"## {title}\n")
        parts += [_entry(name) for name in names]
    return "\n".join(parts).rstrip() + "\n"


def _entry(name: str) -> str:
    """A public name: its definition and what it says."""
    module, definition, below = _defined(name)
    lines = [f"### {name}", ""]
    if isinstance(definition, ast.FunctionDef):
        lines += [_code(_signature(definition)), *_docstring(ast.get_docstring(definition) or "")]
    elif isinstance(definition, ast.Assign):
        lines += [_code(ast.unparse(definition)), *_docstring(below)]
    else:
        lines += _class(definition)
    source = f"{module.__name__.replace('.', '/')}.py"
    return "\n".join([*lines, f"<small>`{source}`</small>", ""])


def _defined(name: str) -> tuple[ModuleType, _Definition, str]:
    """Where a name is defined, how, and the text below it."""
    for module in _modules():
        tree = ast.parse(inspect.getsource(module))
        for node, follows in zip(tree.body, [*tree.body[1:], None], strict=True):
            named = isinstance(node, ast.FunctionDef | ast.ClassDef) and node.name == name
            if isinstance(node, ast.Assign):
                named = isinstance(node.targets[0], ast.Name) and node.targets[0].id == name
            if named:
                assert isinstance(node, ast.FunctionDef | ast.ClassDef | ast.Assign)
                return module, node, _text(follows)
    raise LookupError(f"companion.api.{name} is defined in none of the modules that it is from")


def _modules() -> Iterator[ModuleType]:
    """The modules that `companion.api` takes its names from."""
    for node in ast.parse(inspect.getsource(api)).body:
        if isinstance(node, ast.ImportFrom) and node.module is not None:
            yield sys.modules[node.module]


def _class(definition: ast.ClassDef) -> list[str]:
    """A class: its text, its fields, its methods."""
    bases = [ast.unparse(base) for base in definition.bases]
    called = f"class {definition.name}({', '.join(bases)})" if bases else f"class {definition.name}"
    lines = [_code(called), *_docstring(ast.get_docstring(definition) or "")]
    rows: list[str] = []
    methods: list[str] = []
    body = definition.body
    for node, follows in zip(body, [*body[1:], None], strict=True):
        if isinstance(node, ast.AnnAssign) and isinstance(node.target, ast.Name):
            rows.append(_row(node.target.id, ast.unparse(node.annotation), _text(follows)))
        elif isinstance(node, ast.FunctionDef) and not node.name.startswith("_"):
            said = ast.get_docstring(node) or ""
            if any(ast.unparse(d) == "property" for d in node.decorator_list):
                rows.append(_row(node.name, ast.unparse(node.returns or ast.Constant(None)), said))
            else:
                methods += [f"**{definition.name}.{node.name}**", "", _code(_signature(node))]
                methods += _docstring(said)
    if rows:
        lines += ["| field | type | |", "|---|---|---|", *rows, ""]
    return lines + methods


def _row(name: str, kind: str, text: str) -> str:
    """A field; a bar in a table's cell is shown differently from place to place, so there is none.

    Raises:
        ValueError: its text has one.
    """
    said = _marked(" ".join(text.split()))
    kinds = " or ".join(f"`{one}`" for one in kind.split(" | "))
    if "|" in said or "|" in kinds:
        raise ValueError(f"{name}: write it without a bar: {kind}, {text}")
    return f"| `{name}` | {kinds} | {said} |"


def _signature(function: ast.FunctionDef) -> str:
    """A function's head, an argument a line if it has many."""
    arguments = function.args
    plain = [a for a in arguments.args if a.arg != "self"]
    lacking = len(plain) - len(arguments.defaults)
    given = [None] * lacking + list(arguments.defaults)
    told = [_argument(a, default) for a, default in zip(plain, given, strict=True)]
    if arguments.kwonlyargs:
        told.append("*")
        pairs = zip(arguments.kwonlyargs, arguments.kw_defaults, strict=True)
        told += [_argument(a, default) for a, default in pairs]
    returns = "" if function.returns is None else f" -> {ast.unparse(function.returns)}"
    line = f"{function.name}({', '.join(told)}){returns}"
    if len(line) <= 80:
        return line
    inside = "".join(f"    {one},\n" for one in told)
    return f"{function.name}(\n{inside}){returns}"


def _argument(argument: ast.arg, default: ast.expr | None) -> str:
    kind = "" if argument.annotation is None else f": {ast.unparse(argument.annotation)}"
    return f"{argument.arg}{kind}" + ("" if default is None else f" = {ast.unparse(default)}")


def _docstring(text: str) -> list[str]:
    """A Google docstring as Markdown: its sections as lists."""
    lines: list[str] = []
    section = ""
    for line in inspect.cleandoc(text).splitlines():
        if line in _SECTIONS:
            section = _SECTIONS[line]
            lines += [f"*{section}*", ""]
            continue
        item = _ITEM.match(line)
        if section and item:
            lines.append(f"- `{item[1]}`: {item[2]}")
        elif section and line.startswith("    "):
            lines.append(f"  {line.strip()}" if lines[-1] else line.strip())
        else:
            lines.append(line)
    return [_marked(line) for line in lines] + [""]


def _marked(line: str) -> str:
    return _ROLE.sub(r"`\1`", line)


def _text(node: ast.stmt | None) -> str:
    """The text that stands below a definition; empty if there is none."""
    if isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant):
        value = node.value.value
        return inspect.cleandoc(value) if isinstance(value, str) else ""
    return ""


def _code(text: str) -> str:
    """Definitions as a block; what is unparsed has the other quotation marks."""
    return f"```python\n{text}\n```\n".replace("'", '"')


def main() -> None:
    """Write the page."""
    PAGE.parent.mkdir(parents=True, exist_ok=True)
    PAGE.write_text(page(), encoding="utf-8")
    print(PAGE)


if __name__ == "__main__":
    main()
