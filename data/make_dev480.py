#!/usr/bin/env python3
"""Makes data/dev480 out of the 960 x 540 development pictures: see data/README.md.

    python3 data/make_dev480.py ../shared/data/dev data/dev480

Needs the Python packages numpy and OpenEXR. Reads every file back after writing and checks it.
"""

import json
import sys
from pathlib import Path

import numpy as np
import OpenEXR

NOTHING = 9e5  # metres; the sky is written as 1e6


def load(path):
    channels = OpenEXR.File(str(path), separate_channels=True).channels()
    return {name: channel.pixels for name, channel in channels.items()}


def round_mantissa(values, kind, bits):
    """Rounds to `bits` bits after the leading one, so that the file compresses as its source does."""
    mantissa, exponent = np.frexp(values.astype(np.float64))
    return np.ldexp(np.round(mantissa * 2.0 ** (bits + 1)) / 2.0 ** (bits + 1), exponent).astype(kind)


def blocks(plane):
    """The four samples of each 2 x 2 block along a last axis."""
    h, w = plane.shape
    return plane.reshape(h // 2, 2, w // 2, 2).transpose(0, 2, 1, 3).reshape(h // 2, w // 2, 4)


def shrink_colour(plane, bits):
    return round_mantissa(blocks(plane.astype(np.float64)).mean(-1), np.float16, bits)


def shrink_depth(plane, covered_only):
    """One true sample: the nearer of the two middle ones, of all four or of those that hit something."""
    samples = np.sort(blocks(plane), -1)
    count = (samples < NOTHING).sum(-1) if covered_only else np.full(samples.shape[:2], 4)
    return np.take_along_axis(samples, (np.maximum(count - 1, 0) // 2)[..., None], -1)[..., 0]


def write(path, channels):
    header = {"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage}
    OpenEXR.File(header, dict(channels)).write(str(path))
    for name, plane in load(path).items():
        assert plane.dtype == channels[name].dtype and np.array_equal(plane, channels[name]), (path, name)


def shrink(source, target, covered_only=False):
    channels = {}
    for name, plane in load(source).items():
        if name == "Z":
            channels[name] = np.ascontiguousarray(shrink_depth(plane, covered_only), np.float32)
        else:
            channels[name] = shrink_colour(plane, 10 if name == "A" else 7)
    write(target, channels)
    return channels


def over_psnr(whole, near, far):
    def srgb(x):
        x = np.clip(x.astype(np.float64), 0, 1)
        return np.where(x <= 0.0031308, 12.92 * x, 1.055 * x ** (1 / 2.4) - 0.055)

    error = [srgb(near[c] + far[c] * (1 - near["A"].astype(np.float64))) - srgb(whole[c]) for c in "RGB"]
    return float(-10 * np.log10(np.mean(np.square(error))))


def camera_json(camera, folder, whole, near, far):
    z = whole["Z"].astype(np.float64)
    hit = near["Z"][near["Z"] < NOTHING]
    camera = dict(camera)
    for dead in ("t_in_s", "spp_input"):
        camera.pop(dead, None)
    camera["width"] //= 2
    camera["height"] //= 2
    camera["pixels_per_unit_tangent_K"] /= 2
    camera["principal_point_px"] = [x / 2 for x in camera["principal_point_px"]]
    camera["z_near_m"] = float(z.min())
    camera["z_far_m"] = float(z[z < NOTHING].max())
    camera["foreground_z_range_m"] = [float(hit.min()), float(hit.max())]
    camera["psnr_foreground_over_behind_vs_input"] = over_psnr(whole, near, far)
    camera["z_kind"] = (
        "planar (along the optical axis), metres, one unfiltered sample of four: the nearer of the two middle "
        "ones; in foreground.exr of those that hit the foreground"
    )
    for light in camera.get("lights", []):
        light["px"] = [x / 2 for x in light["px"]]
    for setting in camera["settings"]:
        a, s, k = setting["aperture_diameter_m"], setting["focus_distance_m"], camera["pixels_per_unit_tangent_K"]
        coc = a * np.abs(z - s) / (z * s) * k
        setting["coc_px"] = {
            "at_z_near": float(a * abs(z.min() - s) / (z.min() * s) * k),
            "at_infinity": a / s * k,
            "percentiles_0_10_50_90_100": [float(p) for p in np.percentile(coc, [0, 10, 50, 90, 100])],
        }
        setting["available"] = (folder / f"{setting['name']}.exr").exists()
        for name in [n for n in setting if n.startswith(("noise_", "psnr_"))]:
            setting[f"{name}_at_960x540"] = setting.pop(name)
        for dead in ("seconds", "file", "lights_by_bokeh_sampler"):
            setting.pop(dead, None)
    return camera


def main(source, target):
    for scene in sorted(p for p in source.iterdir() if p.is_dir()):
        out = target / scene.name
        out.mkdir(parents=True, exist_ok=True)
        whole = shrink(scene / "input.exr", out / "input.exr")
        near = shrink(scene / "foreground.exr", out / "foreground.exr", covered_only=True)
        far = shrink(scene / "behind.exr", out / "behind.exr")
        for reference in sorted(scene.glob("reference_*.exr")):
            shrink(reference, out / reference.name)
        camera = camera_json(json.loads((scene / "camera.json").read_text()), scene, whole, near, far)
        (out / "camera.json").write_text(json.dumps(camera, indent=1) + "\n")
        size = sum(p.stat().st_size for p in out.iterdir())
        print(f"{scene.name}: {size / 1e6:.2f} MB, foreground over behind "
              f"{camera['psnr_foreground_over_behind_vs_input']:.1f} dB")


if __name__ == "__main__":
    main(Path(sys.argv[1]), Path(sys.argv[2]))
