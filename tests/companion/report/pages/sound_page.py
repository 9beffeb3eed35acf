"""A page as its tags, links and texts; what every page must have."""

import re
from html.parser import HTMLParser

_VOID = {"meta", "link", "br", "hr", "img", "input", "col", "source", "wbr"}


class SoundPage(HTMLParser):
    """Fails on tags that do not match."""

    def __init__(self, text):
        super().__init__(convert_charrefs=True)
        self.source = text
        self.open = []
        self.tags = []
        self.ids = []
        self.text = []
        self.figures = []
        self.feed(text)
        self.close()
        assert self.open == []

    def handle_starttag(self, tag, attrs):
        attributes = dict(attrs)
        self.tags.append((tag, attributes))
        if "id" in attributes:
            self.ids.append(attributes["id"])
        if tag == "figure":
            self.figures.append({"drawings": 0, "caption": ""})
        if tag in ("svg", "img") and "figure" in self.open:
            self.figures[-1]["drawings"] += 1
        if tag not in _VOID:
            self.open.append(tag)

    def handle_startendtag(self, tag, attrs):
        self.handle_starttag(tag, attrs)
        if tag not in _VOID:
            self.open.pop()

    def handle_endtag(self, tag):
        assert self.open.pop() == tag

    def handle_data(self, data):
        self.text.append(data)
        if "figcaption" in self.open:
            self.figures[-1]["caption"] += data

    @property
    def said(self):
        return re.sub(r"\s+", " ", "".join(self.text))

    def all_of(self, tag):
        return [attributes for name, attributes in self.tags if name == tag]

    @property
    def links(self):
        """Out of the page."""
        found = [value for _, a in self.tags for key, value in a.items() if key in ("href", "src")]
        return [link for link in found if not link.startswith("#")]


def check_page(path):
    """What holds for every page; the page.

    It needs nothing but the files beside it; each drawing has a caption and a description; each
    link leads to something; the summary box comes first and the command that makes it again last.
    """
    page = SoundPage(path.read_text(encoding="utf-8"))
    assert len(page.ids) == len(set(page.ids))
    inside = {a["href"][1:] for a in page.all_of("a") if a["href"].startswith("#")}
    assert inside <= set(page.ids)
    assert "provenance" in inside
    assert not re.search(r"https?:|//[a-z]+\.|@import|url\((?!#)|<script", page.source)
    for link in page.links:
        assert (path.parent / link).exists(), link
    drawn = [tag for tag, _ in page.tags if tag in ("svg", "img")]
    assert len(drawn) == sum(figure["drawings"] for figure in page.figures)
    assert all(figure["drawings"] == 1 and figure["caption"].strip() for figure in page.figures)
    told = [a.get("aria-label") or a.get("alt") for a in page.all_of("svg") + page.all_of("img")]
    assert all(told) or "<title>" in page.source.partition("<svg")[2]
    assert page.ids[0] == "glance"
    for must in ("prefers-color-scheme: dark", "@media print", 'name="viewport"'):
        assert must in page.source
    assert page.source.count("<h1>") == 1
    return page
