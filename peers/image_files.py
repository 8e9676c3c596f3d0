"""Image files, by way of Mitsuba's reader and writer. Images are height × width × 3, linear RGB, row 0 on top."""

import mitsuba as mi
import numpy as np

if mi.variant() is None:
    mi.set_variant("scalar_rgb")

HALF, FLOAT = mi.Struct.Type.Float16, mi.Struct.Type.Float32


def read(path):
    """An EXR's RGB, f64."""
    return np.array(mi.Bitmap(str(path)).convert(mi.Bitmap.PixelFormat.RGB, FLOAT), dtype=float)


def write(path, image, comment="", component=FLOAT):
    """An EXR, or a Radiance picture where the path ends in .hdr."""
    bitmap = mi.Bitmap(np.ascontiguousarray(image, dtype=np.float32)).convert(component_format=component)
    if comment:
        bitmap.metadata()["comments"] = comment
    bitmap.write(str(path))


def memory_bitmap(data):
    """Mitsuba's bitmap of a PNG or JPEG that is in memory."""
    file = mi.MemoryStream()
    file.write(data)
    file.seek(0)
    return mi.Bitmap(file)


def decoded(data):
    """A PNG or JPEG in sRGB as linear light."""
    return np.array(memory_bitmap(data).convert(mi.Bitmap.PixelFormat.RGB, FLOAT, srgb_gamma=False), dtype=float)


def values(data):
    """The texels of a PNG or JPEG that holds no light, 0 to 1."""
    bitmap = memory_bitmap(data)
    bitmap.set_srgb_gamma(False)
    return np.array(bitmap.convert(mi.Bitmap.PixelFormat.RGB, FLOAT, srgb_gamma=False), dtype=float)
