"""A figure's SVG made part of an HTML page: ids of its own, the page's colours."""

import html
import re

from companion.report.pages.style import DARK

_VARIABLE = "figure-{}"


def inline_svg(text: str, name: str, description: str) -> str:
    """The `svg` element for a page.

    Args:
        text: of a file by matplotlib.
        name: of the figure, put before each id so that those of several figures differ.
        description: what one who can't see it is told.

    Raises:
        ValueError: it holds no `svg` element.
    """
    begin, end = text.find("<svg"), text.rfind("</svg>")
    if begin < 0 or end < 0:
        raise ValueError(f"the figure {name} has no svg element")
    body = text[begin : end + len("</svg>")]
    # The page has these rules; as part of a page they would hold for all of it.
    body = re.sub(r"\s*<defs>\s*<style[^>]*>.*?</style>\s*</defs>", "", body, flags=re.DOTALL)
    body = body.replace("xlink:href=", "href=")
    body = re.sub(r'\bid="', f'id="{name}-', body)
    body = re.sub(r"url\(#", f"url(#{name}-", body)
    body = re.sub(r'\bhref="#', f'href="#{name}-', body)
    box = re.search(r'viewBox="[^"]*"', body)
    told = html.escape(description, quote=True)
    opening = f'<svg role="img" aria-label="{told}" {box.group(0) if box else ""}>'
    body = re.sub(r"^<svg[^>]*>", lambda _: opening, body)
    for colour in DARK:
        body = body.replace(colour, f"var(--{_VARIABLE.format(colour[1:])})")
    return body


def colour_rules(dark: bool) -> str:
    """CSS declarations of the figures' colours."""
    return " ".join(
        f"--{_VARIABLE.format(light[1:])}: {shade if dark else light};"
        for light, shade in DARK.items()
    )
