"""Makes the TIFF files in this folder with another program: pip install numpy tifffile; python3 make.py

The sample of channel c at column x of row y is (100 c + 10 y + x) / 256, which a half holds exactly; as 8-bit
number 100 c / 4 + 10 y + x.
"""

import numpy as np
import tifffile

y, x, c = np.meshgrid(np.arange(4), np.arange(5), np.arange(4), indexing="ij")
real = ((100 * c + 10 * y + x) / 256).astype(np.float32)
code = (100 * c // 4 + 10 * y + x).astype(np.uint8)
quiet = {"software": None, "metadata": None}
tifffile.imwrite("planar_float.tif", real[..., :3].transpose(2, 0, 1).copy(), photometric="rgb",
                 planarconfig="separate", **quiet)
tifffile.imwrite("tiled_half.tif", real[..., :3].astype(np.float16), photometric="rgb", tile=(16, 16),
                 compression="zlib", **quiet)
tifffile.imwrite("big_endian_double.tif", real[..., 0].astype(np.float64), photometric="minisblack",
                 byteorder=">", bigtiff=True, **quiet)
tifffile.imwrite("mask_beside_colours.tif", code, photometric="rgb", extrasamples=["unspecified"], **quiet)
tifffile.imwrite("signed.tif", code[..., 0].astype(np.int16), photometric="minisblack", **quiet)
