"""Makes the numbers in published_values.rs: FLIP's published tool and plain float64 formulas on small pairs.

    pip install flip-evaluator==1.7 numpy scipy
    python3 published_values.py
"""

import flip_evaluator
import numpy as np
from scipy import ndimage


def picture(width, height, value):
    """8-bit values from whole-number formulas, so that every language makes the same ones."""
    y, x, c = np.meshgrid(np.arange(height), np.arange(width), np.arange(3), indexing="ij")
    return (value(x, y, c) % 256).astype(np.float32) / np.float32(255)


def noise(x, y, c):
    return ((x * 7919 + y * 104729 + c * 1299709) ^ (x * y * 31)) >> 3


def scene(shift):
    def value(x, y, c):
        bars = np.where((x + shift) // 6 % 2 == 0, 40 + 50 * c, 200 - 60 * c)
        ramp = (3 * x + 2 * y + 30 * c) % 256
        lamp = np.where((x - 40 - shift) ** 2 + (y - 20) ** 2 < 30, 255, 0)
        return np.maximum(np.where(y < 24, bars, ramp), lamp)
    return value


PAIRS = {
    "bars, a ramp and a lamp, moved by two pixels": (64, 48, scene(0), scene(2)),
    "noise against other noise": (37, 29, noise, lambda x, y, c: noise(x + 5, y + 3, c)),
    "green against blue": (24, 16, lambda x, y, c: 255 * (c == 1), lambda x, y, c: 255 * (c == 2)),
    "a dark grey one step apart": (32, 20, lambda x, y, c: 0 * x + 12, lambda x, y, c: 0 * x + 13),
    "narrower than the filters": (5, 3, noise, scene(0)),
    "two strips of rows": (20, 700, scene(0), lambda x, y, c: scene(0)(x, y, c) + (x + y) % 9 - 4),
}


def ssim(a, b):
    a, b = (p.astype(np.float64) @ [0.2126, 0.7152, 0.0722] for p in (a, b))
    k = np.exp(-np.arange(-5, 6) ** 2 / 4.5)
    k /= k.sum()
    f = lambda p: ndimage.correlate1d(ndimage.correlate1d(p, k, 0), k, 1)[5:-5, 5:-5]
    ma, mb = f(a), f(b)
    va, vb, ab = f(a * a) - ma**2, f(b * b) - mb**2, f(a * b) - ma * mb
    return np.mean((2 * ma * mb + 1e-4) * (2 * ab + 9e-4) / ((ma**2 + mb**2 + 1e-4) * (va + vb + 9e-4)))


for name, (width, height, one, two) in PAIRS.items():
    a, b = picture(width, height, one), picture(width, height, two)
    field, mean, _ = flip_evaluator.evaluate(a, b, "LDR", applyMagma=False)
    x, y = width * 2 // 3, height // 3
    psnr = -10 * np.log10(np.mean((a.astype(np.float64) - b) ** 2))
    structure = ssim(a, b) if min(width, height) >= 11 else None
    print(f"{name}: flip {mean:.6f}, corner {field[0, 0, 0]:.6f}, at ({x}, {y}) {field[y, x, 0]:.6f}, "
          f"psnr {psnr:.6f}, ssim {structure if structure is None else round(float(structure), 6)}")
