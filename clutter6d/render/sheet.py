"""Contact sheets: many pictures on one page, each with its label."""

from collections.abc import Sequence
from io import BytesIO
from pathlib import Path

import numpy as np
from jaxtyping import UInt8
from PIL import Image, ImageDraw, ImageFont

from clutter6d.errors import InvalidValueError
from clutter6d.schema import write_bytes

_MARGIN_PX, _LABEL_PX, _FONT_PX = 6, 22, 14
_PAPER, _INK = (255, 255, 255), (40, 44, 52)


def contact_sheet(
    images: Sequence[UInt8[np.ndarray, "_ _ 3"]], labels: Sequence[str], columns: int, *, cell_width: int | None = None
) -> Image.Image:
    """Lay pictures of one size out in rows, each above its label.

    Args:
        images: Pictures, all of the same size.
        labels: One line for each; cut to the picture's width.
        columns: Pictures in a row.
        cell_width: Width to which pictures are shrunk [px]; by default, and at most, their own.

    Raises:
        InvalidValueError: No pictures, pictures of different sizes, or as many labels as there are not pictures.
    """
    sizes = {image.shape for image in images}
    if len(sizes) != 1 or len(labels) != len(images) or columns < 1:
        raise InvalidValueError(
            f"contact sheet: {len(images)} images of {len(sizes)} sizes, {len(labels)} labels, {columns} columns; "
            "give images of one size, one label for each, and at least one column"
        )
    height, width, _ = images[0].shape
    if cell_width is not None and cell_width < width:
        height, width = max(1, round(height * cell_width / width)), cell_width
    columns = min(columns, len(images))
    rows = -(-len(images) // columns)
    cell = (width + _MARGIN_PX, height + _LABEL_PX + _MARGIN_PX)
    sheet = Image.new("RGB", (columns * cell[0] + _MARGIN_PX, rows * cell[1] + _MARGIN_PX), _PAPER)
    draw, font = ImageDraw.Draw(sheet), ImageFont.load_default(_FONT_PX)
    for index, (image, label) in enumerate(zip(images, labels, strict=True)):
        x, y = _MARGIN_PX + index % columns * cell[0], _MARGIN_PX + index // columns * cell[1]
        sheet.paste(Image.fromarray(image).resize((width, height), Image.Resampling.BOX), (x, y))
        draw.text((x + 2, y + height + 2), _cut(label, width - 4, font), fill=_INK, font=font)
    return sheet


def write_image(path: Path, image: UInt8[np.ndarray, "height width 3"] | Image.Image) -> None:
    """Write a PNG atomically.

    Raises:
        StorageError: It cannot be written.
    """
    write_bytes(path, png_of(image))


def png_of(image: UInt8[np.ndarray, "height width 3"] | Image.Image) -> bytes:
    """A picture as a PNG file; equal pictures give equal bytes."""
    buffer = BytesIO()
    picture = image if isinstance(image, Image.Image) else Image.fromarray(image)
    picture.save(buffer, format="PNG")
    return buffer.getvalue()


def _cut(label: str, width: int, font: ImageFont.ImageFont | ImageFont.FreeTypeFont) -> str:
    if font.getlength(label) <= width:
        return label
    while label and font.getlength(label + "...") > width:
        label = label[:-1]
    return label + "..."
