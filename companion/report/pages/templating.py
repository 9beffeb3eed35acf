"""Pages from templates: one environment, so that all of them escape and fail in the same way."""

from collections.abc import Callable, Mapping
from typing import Any

from companion.report.pages.inline_svg import colour_rules

_OURS = "companion.report.pages"


def render_page(
    package: str,
    template: str,
    context: Mapping[str, Any],
    filters: Mapping[str, Callable[..., Any]] | None = None,
) -> str:
    """A page's text.

    The templates of this package are found too: `page.html.j2`, which every page extends, and
    `parts.html.j2`.  `light_colours` and `dark_colours` are the figures' colours as CSS.

    Args:
        package: whose folder `templates` holds the page's own.
        template: its name.
        context: its variables; one that is missing is an error.
        filters: of its own, by name.
    """
    import jinja2 as jinja

    loaders = [jinja.PackageLoader(one) for one in (package, _OURS)]
    environment = jinja.Environment(
        loader=jinja.ChoiceLoader(loaders),
        autoescape=True,
        undefined=jinja.StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.filters |= dict(filters or {})
    colours = {"light_colours": colour_rules(dark=False), "dark_colours": colour_rules(dark=True)}
    text: str = environment.get_template(template).render({**colours, **context})
    return text
