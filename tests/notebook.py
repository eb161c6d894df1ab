"""What a notebook makes of an object: its HTML, read as a browser would."""

import base64
import io
from html.parser import HTMLParser

import numpy as np
from PIL import Image


class Page(HTMLParser):
    """Tags seen and still open, sources of pictures, and the text of a piece of HTML."""

    def __init__(self, text):
        super().__init__()
        self.tags, self.open, self.sources, self.text = set(), [], [], ""
        self.feed(text)
        self.close()

    def handle_starttag(self, tag, attributes):
        self.tags.add(tag)
        if tag == "img":
            self.sources.append(dict(attributes)["src"])
        else:
            self.open.append(tag)

    def handle_endtag(self, tag):
        assert self.open.pop() == tag

    def handle_data(self, data):
        self.text += data


def shown(thing):
    """The page of an object, checked to be whole, and its one picture, (height, width, 3)."""
    page = Page(thing._repr_html_())
    assert not page.open and len(page.sources) == 1
    kind, data = page.sources[0].split(",")
    assert kind == "data:image/png;base64"
    return page, np.asarray(Image.open(io.BytesIO(base64.b64decode(data))).convert("RGB"))
