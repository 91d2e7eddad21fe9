"""Pictures that a failing test leaves behind, build/test/pictures/NAME.png: what it rendered last, side by side."""

import re
import struct
import zlib
from collections import deque
from pathlib import Path

import numpy as np

FOLDER = Path(__file__).resolve().parents[1] / "build" / "test" / "pictures"
LARGEST = 1024  # pixels across; larger pictures are thinned out

_kept = deque(maxlen=4)


def keep(pixels):
    """Remembers a picture, (height, width, channels) linear, rows from bottom to top, until the next test begins."""
    step = max(1, -(-max(pixels.shape[:2]) // LARGEST))
    _kept.append(np.array(pixels[::step, ::step, :3], np.float32))


def forget():
    _kept.clear()


def leave(test_name):
    """Writes the pictures kept so far, the last one at the right; the paths written."""
    name = re.sub(r"[^A-Za-z0-9.-]+", "_", test_name).strip("_")
    paths = [FOLDER / f"{name}{'' if number == len(_kept) else f'.{number}'}.png" for number in range(1, len(_kept) + 1)]
    for path, pixels in zip(paths, _kept):
        write_png(path, pixels)
    return paths


def write_png(path, pixels):
    """An 8-bit PNG, exposed so that nearly all is in range; magenta where a pixel is not finite."""
    finite = np.isfinite(pixels).all(axis=-1)
    shown = np.where(finite[..., None], pixels, 0.0).astype(np.float64)
    shown = np.broadcast_to(shown, (*shown.shape[:2], 3))
    white = max(np.quantile(shown, 0.98), 1e-30)
    encoded = np.clip(shown / (white if white > 1.0 or white < 0.05 else 1.0), 0.0, 1.0) ** (1 / 2.2)
    encoded[~finite] = (1.0, 0.0, 1.0)
    rows = (encoded[::-1] * 255.0 + 0.5).astype(np.uint8)
    height, width = rows.shape[:2]
    lines = b"".join(b"\0" + row.tobytes() for row in rows)
    path.parent.mkdir(parents=True, exist_ok=True)
    header = struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0)
    chunks = _chunk(b"IHDR", header) + _chunk(b"IDAT", zlib.compress(lines)) + _chunk(b"IEND", b"")
    path.write_bytes(b"\x89PNG\r\n\x1a\n" + chunks)


def _chunk(kind, data):
    return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))
