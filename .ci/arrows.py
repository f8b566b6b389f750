#!/usr/bin/env python3
"""Checks the arrows between the workspace's crates against the ones that ARCHITECTURE.md states.

A crate may depend only on those listed for it here (tests and benches may add the unpublished test kit); no
library may know the libraries of programs.
"""

import json
import subprocess
import sys

ALLOWED = {
    "pullfocus-core": set(),
    "pullfocus-cpu": {"pullfocus-core"},
    "pullfocus-gpu": {"pullfocus-core"},
    "pullfocus": {"pullfocus-core", "pullfocus-cpu", "pullfocus-gpu"},
    "pullfocus-io": {"pullfocus-core"},
    "pullfocus-metrics": {"pullfocus-core"},
    "pullfocus-job": {"pullfocus", "pullfocus-core", "pullfocus-io"},
    "pullfocus-view": {
        "pullfocus", "pullfocus-core", "pullfocus-gpu", "pullfocus-io", "pullfocus-job", "pullfocus-metrics",
    },
    "pullfocus-cli": {"pullfocus", "pullfocus-core", "pullfocus-io", "pullfocus-job", "pullfocus-metrics", "pullfocus-view"},
    "pullfocus-testkit": {"pullfocus-core"},
    "pullfocus-bench": {
        "pullfocus", "pullfocus-core", "pullfocus-cpu", "pullfocus-gpu", "pullfocus-io", "pullfocus-metrics",
        "pullfocus-testkit",
    },
    "pullfocus-example-live-scene": {"pullfocus-core", "pullfocus-gpu"},
}
PROGRAMS = {"pullfocus-cli", "pullfocus-job", "pullfocus-view", "pullfocus-bench", "pullfocus-example-live-scene"}
UNPUBLISHED = {"pullfocus-testkit", "pullfocus-bench", "pullfocus-example-live-scene"}
OF_PROGRAMS = {"clap", "anyhow", "indicatif", "egui", "eframe", "tracing-subscriber"}


def faults(packages):
    for package in packages:
        name = package["name"]
        if name not in ALLOWED:
            yield f"{name} is not listed in .ci/arrows.py: say what it may know"
            continue
        if name in UNPUBLISHED and package["publish"] != []:
            yield f"{name} must have publish = false"
        for dependency in package["dependencies"]:
            other, kind = dependency["name"], dependency["kind"] or "normal"
            if other.startswith("pullfocus") and other not in ALLOWED[name]:
                if not (kind == "dev" and other == "pullfocus-testkit"):
                    yield f"{name} must not know {other} ({kind} dependency)"
            if other in OF_PROGRAMS and name not in PROGRAMS and kind == "normal":
                yield f"{name} is a library and must not know {other}, which is for programs"


def main():
    command = ["cargo", "metadata", "--format-version", "1", "--no-deps"]
    packages = json.loads(subprocess.run(command, check=True, capture_output=True, text=True).stdout)["packages"]
    found = list(faults(packages))
    for fault in found:
        print(f"error: {fault}", file=sys.stderr)
    print(f"{len(packages)} crates, {len(found)} arrows that should not be")
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())
