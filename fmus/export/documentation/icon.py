"""The picture of an FMU that tools show: a block with its name, its inputs at the left, its outputs at the right."""

import io
from collections.abc import Sequence
from functools import cache
from typing import Any

from PIL import Image, ImageDraw, ImageFont

WIDTH, TITLE, ROW, MARGIN, ARROW = 480, 56, 27, 34, 9  # pixels
MOST = 12
"""Ports that are drawn on a side; of more the last row says how many."""

PAPER, EDGE, INK, HEAD = "#ffffff", "#2f4858", "#1c2733", "#dfe8ee"


def icon(title: str, inputs: Sequence[str], outputs: Sequence[str]) -> bytes:
    """Return a PNG; the same names give the same bytes."""
    left, right = _shown(inputs), _shown(outputs)
    height = TITLE + ROW * max(len(left), len(right), 2) + MARGIN // 2
    image = Image.new("RGB", (WIDTH, height), PAPER)
    draw = ImageDraw.Draw(image)
    x0, x1 = MARGIN, WIDTH - MARGIN
    draw.rounded_rectangle((x0, 4, x1, height - 5), 10, fill=PAPER, outline=EDGE, width=3)
    draw.rounded_rectangle((x0, 4, x1, TITLE - 6), 10, fill=HEAD, outline=EDGE, width=3)
    _text(draw, (WIDTH / 2, TITLE / 2), title, "mm", x1 - x0 - 20, 25)
    room = (x1 - x0) / 2 - 18
    for i, name in enumerate(left):
        y = TITLE + ROW * (i + 0.5)
        _arrow(draw, x0 - 24, x0, y)
        _text(draw, (x0 + 12, y), name, "lm", room, 17)
    for i, name in enumerate(right):
        y = TITLE + ROW * (i + 0.5)
        _arrow(draw, x1, x1 + 24, y)
        _text(draw, (x1 - 12, y), name, "rm", room, 17)
    out = io.BytesIO()
    image.save(out, "PNG")
    return out.getvalue()


@cache  # Pillow's own font is unpacked each time
def _font(size: int) -> Any:
    return ImageFont.load_default(size)


def _shown(names: Sequence[str]) -> list[str]:
    return list(names) if len(names) <= MOST else [*names[: MOST - 1], f"{len(names) - MOST + 1} more"]


def _text(draw: ImageDraw.ImageDraw, at: tuple[float, float], text: str, anchor: str, room: float, size: int) -> None:
    """Write a text at most `room` wide, smaller where it must be."""
    font = _font(size)
    wide = draw.textlength(text, font)
    if wide > room:
        font = _font(int(size * room / wide))
    draw.text(at, text, fill=INK, font=font, anchor=anchor)


def _arrow(draw: ImageDraw.ImageDraw, start: float, end: float, y: float) -> None:
    draw.line((start, y, end - 2, y), fill=EDGE, width=3)
    draw.polygon(((end - ARROW, y - ARROW / 2 - 1), (end - ARROW, y + ARROW / 2 + 1), (end, y)), fill=EDGE)
