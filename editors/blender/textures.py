"""Images as textures. Needs no Blender: what is asked of an image is what `bpy.types.Image` has."""

from __future__ import annotations

from typing import Any

import numpy as np

# The share of each colour in how bright a pixel is (ITU-R BT.709).
LUMINANCE = np.array([0.2126, 0.7152, 0.0722], dtype=np.float32)

# Rows that a panorama has at least. The engine averages squares as large as its pixels, Blender interpolates between
# pixels; in a small panorama the difference would show.
FINE = 256


def raw(image: Any) -> np.ndarray | None:
    """The numbers of an image as its file has them: float32 (height, width, 4), row 0 on top; None without any."""
    width, height = image.size
    channels = image.channels
    if width == 0 or height == 0 or channels not in (1, 3, 4):
        return None
    pixels = np.empty(width * height * channels, dtype=np.float32)
    image.pixels.foreach_get(pixels)
    pixels = pixels.reshape(height, width, channels)[::-1]
    if channels == 4:
        return pixels
    made = np.ones((height, width, 4), dtype=np.float32)
    made[:, :, :3] = pixels
    return made


def is_encoded(image: Any) -> bool:
    """Whether its numbers are in sRGB."""
    return not image.is_float and image.colorspace_settings.name not in ("Non-Color", "Linear Rec.709", "Linear")


def linear(image: Any) -> np.ndarray | None:
    """Its pixels in linear light."""
    pixels = raw(image)
    if pixels is None or not is_encoded(image):
        return pixels
    x = np.maximum(pixels[:, :, :3], 0)
    made = pixels.copy()
    made[:, :, :3] = np.where(x <= 0.04045, x / 12.92, ((x + 0.055) / 1.055) ** 2.4)
    return made


def color(image: Any, holes: bool) -> np.ndarray | None:
    """A texture of colours in sRGB, with alpha where there are holes."""
    pixels = raw(image)
    if pixels is None:
        return None
    if not is_encoded(image):
        x = np.clip(pixels[:, :, :3], 0, 1)
        pixels = pixels.copy()
        # IEC 61966-2-1.
        pixels[:, :, :3] = np.where(x <= 0.0031308, 12.92 * x, 1.055 * x ** (1 / 2.4) - 0.055)
    return _bytes(pixels[:, :, : 4 if holes else 3])


def normal(image: Any) -> np.ndarray | None:
    """A texture of normals, as the file has them."""
    pixels = raw(image)
    return None if pixels is None else _bytes(pixels[:, :, :3])


def finish(roughness: Any, metallic: Any) -> np.ndarray | None:
    """A texture with roughness in green and metalness in blue, of channels of images; where there is none, 1."""
    found = [None if c is None else _of(c) for c in (roughness, metallic)]
    given = [f for f in found if f is not None]
    if not given:
        return None
    height, width = (max(f.shape[axis] for f in given) for axis in (0, 1))
    made = np.ones((height, width, 3), dtype=np.float32)
    for place, one in enumerate(found, start=1):
        if one is not None:
            rows, columns = (np.arange(n) * m // n for n, m in zip((height, width), one.shape))
            made[:, :, place] = one[rows][:, columns]
    return _bytes(made)


def turned(panorama: np.ndarray, turns: float) -> np.ndarray:
    """Turns a panorama to the right by a share of its width. A small one is interpolated to at least FINE rows."""
    high, wide = panorama.shape[:2]
    finer = max(1, -(-FINE // high))
    columns = _centres(wide, finer) - turns * wide
    low = np.floor(columns)
    left, share = low.astype(np.int64), (columns - low).astype(np.float32)[:, None]
    moved = panorama[:, left % wide] * (1 - share) + panorama[:, (left + 1) % wide] * share
    if finer == 1:
        return moved
    rows = np.clip(_centres(high, finer), 0, high - 1)
    above = rows.astype(np.int64)
    share = (rows - above).astype(np.float32)[:, None, None]
    return moved[above] * (1 - share) + moved[np.minimum(above + 1, high - 1)] * share


def _centres(count: int, finer: int) -> np.ndarray:
    """Returns the centres of `finer` times as many pixels, in pixels from the first one's centre."""
    return (np.arange(count * finer) + 0.5) / finer - 0.5


def _of(channel: Any) -> np.ndarray | None:
    pixels = linear(channel.image)
    if pixels is None:
        return None
    place = "RGB".find(channel.name) if channel.name else -1
    return pixels[:, :, :3] @ LUMINANCE if place < 0 else pixels[:, :, place]


def _bytes(pixels: np.ndarray) -> np.ndarray:
    return (np.clip(pixels, 0, 1) * 255 + 0.5).astype(np.uint8)
