"""A figure of matplotlib as SVG text."""

import io
import re

from matplotlib.figure import Figure

_FALLBACKS = "'DejaVu Sans', Verdana, Geneva, sans-serif"


def svg_text(figure: Figure) -> str:
    """The figure as SVG: the same bytes for the same data, with families to fall back to.

    Drawn under `style.SETTINGS`, so that letters stay letters.
    """
    buffer = io.StringIO()
    figure.savefig(buffer, format="svg", metadata={"Date": None, "Creator": None})
    text = re.sub(r"<metadata>.*?</metadata>\s*", "", buffer.getvalue(), flags=re.DOTALL)
    return text.replace("'DejaVu Sans'", _FALLBACKS)
