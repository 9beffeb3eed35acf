"""``companion --help`` by groups: what flies, what prepares, what studies, what reads logs."""

from typing import Any

from typer.core import TyperGroup

_OTHERS = "More"


class GroupedHelp(TyperGroup):
    """Lists the commands under the panel that each was registered with.

    Typer does so by itself where rich writes the help, which would take a third of a second more.
    """

    def format_commands(self, ctx: Any, formatter: Any) -> None:  # noqa: ANN401 - of typer's click
        """Write a list for each panel, in the order in which the panels come first."""
        panels: dict[str, list[tuple[str, Any]]] = {}
        for name in self.list_commands(ctx):
            command = self.get_command(ctx, name)
            if command is not None and not command.hidden:
                panel = getattr(command, "rich_help_panel", None) or _OTHERS
                panels.setdefault(panel, []).append((name, command))
        widest = max(len(name) for of_panel in panels.values() for name, _ in of_panel)
        for panel, of_panel in panels.items():
            with formatter.section(panel):
                formatter.write_dl(
                    [
                        # One line each; what is not short is cut.
                        (name.ljust(widest), command.get_short_help_str(formatter.width - widest))
                        for name, command in of_panel
                    ]
                )
