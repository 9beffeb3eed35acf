"""Pages from templates: one environment, so that all of them escape and fail in the same way."""

from collections.abc import Callable, Mapping
from types import ModuleType
from typing import Any

from companion.experiments.flight_store import MissingExtraError
from companion.report.pages.inline_svg import colour_rules

_OURS = "companion.report.pages"


def need_page_library() -> None:
    """Fail now rather than after the flights.

    Raises:
        MissingExtraError: jinja2 is not installed.
    """
    _jinja()


def render_page(
    package: str,
    template: str,
    context: Mapping[str, Any],
    filters: Mapping[str, Callable[..., Any]] | None = None,
) -> str:
    """A page's text.

    The templates of this package are found too: `base.css.j2`, which every page begins its style
    with, and `figures.j2`.  `light_colours` and `dark_colours` are the figures' colours as CSS.

    Args:
        package: whose folder `templates` holds the page's own.
        template: its name.
        context: its variables; one that is missing is an error.
        filters: of its own, by name.

    Raises:
        MissingExtraError: jinja2 is not installed.
    """
    jinja = _jinja()
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


def _jinja() -> ModuleType:
    try:
        import jinja2
    except ImportError as error:
        raise MissingExtraError(
            "The page is made with jinja2, which is missing: pip install 'companion[study]'"
        ) from error
    return jinja2
