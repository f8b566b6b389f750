#!/usr/bin/env python3
"""The real window from end to end: on a screen in memory (Xvfb), with a mouse and keys that are not there (xdotool).

    .ci/window.py PROGRAM [FOLDER]

opens a shipped frame, focuses, looks around, holds it as a still, keys a pull and saves it; what is saved must say what was done and
render. Between steps the program must come to rest, without use of the processor.
Pictures of the window go to FOLDER (docs/pictures with `docs`, for the guide), else nowhere.
"""

import os
import pathlib
import re
import subprocess
import sys
import tempfile
import time

ROOT = pathlib.Path(__file__).resolve().parent.parent
FRAME = ROOT / "data/dev480/S5_tabletop/input.exr"
SIZE = (1440, 900)
DISPLAY = ":77"


class Window:
    def __init__(self, program, home, shots):
        self.shots = shots
        self.env = dict(os.environ, DISPLAY=DISPLAY, XDG_RUNTIME_DIR=home, XDG_CONFIG_HOME=home, HOME=home)
        screen = f"{SIZE[0]}x{SIZE[1]}x24"
        # Without a reset it outlives its last client, who may be xdotool, asking whether the program is there yet.
        command = ["Xvfb", DISPLAY, "-noreset", "-screen", "0", screen]
        self.screen = subprocess.Popen(command, stderr=subprocess.DEVNULL)
        self.program = program
        self.process = None
        self.wait_for(lambda: self.tool("getmouselocation", check=False) != "", 30)

    def launch(self, *arguments):
        self.process = subprocess.Popen([self.program, *map(str, arguments)], env=self.env)

    def start(self, *arguments):
        self.launch("view", *arguments)
        # The window, then the first picture.
        self.wait_for(lambda: self.tool("search", "--onlyvisible", "--name", "pullfocus", check=False) != "")
        # Without a window manager nobody gives it the keyboard.
        self.wait_for(self.take_keyboard)
        self.rest()

    def take_keyboard(self, name="pullfocus"):
        """Whether the window of this name, which may not be quite there yet, has taken it."""
        window = self.tool("search", "--onlyvisible", "--name", name, check=False).splitlines()[-1:]
        command = ["xdotool", "windowfocus", *window]
        return bool(window) and subprocess.run(command, env=self.env, capture_output=True).returncode == 0

    def tool(self, *arguments, check=True):
        done = subprocess.run(["xdotool", *map(str, arguments)], env=self.env, capture_output=True, text=True)
        if check and done.returncode != 0:
            raise SystemExit(f"xdotool {arguments}: {done.stderr}")
        return done.stdout.strip()

    def wait_for(self, there, seconds=60):
        end = time.time() + seconds
        while not there():
            if time.time() > end or (self.process and self.process.poll() is not None):
                raise SystemExit("the window did not come to what was expected")
            time.sleep(0.1)

    def processor_seconds(self):
        fields = pathlib.Path(f"/proc/{self.process.pid}/stat").read_text().rsplit(")", 1)[1].split()
        return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")

    def rest(self):
        """Until the program uses no processor: then all that was asked for is on the screen."""
        def calm():
            before = self.processor_seconds()
            time.sleep(0.7)
            return self.processor_seconds() - before < 0.03
        self.wait_for(calm)

    def click(self, x, y):
        self.tool("mousemove", x, y)
        time.sleep(0.2)
        self.tool("click", 1)
        self.rest()

    def drag(self, start, end):
        self.tool("mousemove", *start, "mousedown", 1)
        for i in range(1, 9):
            at = [round(a + (b - a) * i / 8) for a, b in zip(start, end)]
            self.tool("mousemove", *at)
            time.sleep(0.05)
        self.tool("mouseup", 1)
        self.rest()

    def keys(self, *keys, rest=True):
        for key in keys:
            self.tool("key", key)
            time.sleep(0.15)
        if rest:
            self.rest()

    def type(self, text):
        self.tool("type", "--delay", "20", text)
        time.sleep(0.3)

    def shot(self, name):
        if self.shots:
            # Beside everything that has a hint.
            self.tool("mousemove", SIZE[0] - 2, SIZE[1] - 2)
            self.rest()
            target = self.shots / f"{name}.jpg"
            subprocess.run(["import", "-window", "root", "-quality", "80", target], env=self.env, check=True)

    def close(self):
        """Asks the program to end, which closes its window; it must end well."""
        self.process.terminate()
        code = self.process.wait(30)
        if code != 0:
            raise SystemExit(f"the window did not end well: exit code {code}")

    def end(self):
        if self.process and self.process.poll() is None:
            self.process.kill()
        self.screen.terminate()
        # The next one has the same number.
        self.screen.wait(30)


def main():
    program = pathlib.Path(sys.argv[1]).resolve()
    shots = None
    if len(sys.argv) > 2:
        shots = ROOT / "docs/pictures" if sys.argv[2] == "docs" else pathlib.Path(sys.argv[2])
        shots.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory() as home:
        home = pathlib.Path(home)
        frame = home / "frame.exr"
        frame.write_bytes(FRAME.read_bytes())
        window = Window(program, str(home), shots)
        try:
            window.start(frame, "--no-session")
            # Near the middle of the left edge, the chequered ball; then the cylinder.
            window.click(40, 420)
            window.keys("o")
            window.shot("view_overlay")
            window.keys("o", "w")
            window.shot("view_wipe")
            window.keys("w")
            # A pull on the still: held for two seconds, a key at each end.
            window.click(605, 796)
            window.click(40, 420)
            window.keys("k", "End")
            window.click(410, 175)
            window.keys("k")
            window.keys("Home", "Right", "Right")
            window.shot("view_timeline")
            saved = home / "pull.toml"
            # A field that is typed into blinks, so there is no rest.
            window.keys("ctrl+s", rest=False)
            time.sleep(3)
            window.keys("ctrl+a", rest=False)
            window.type(str(saved))
            window.keys("Return")
            window.wait_for(saved.is_file, 30)
            check(saved, program)
            window.keys("F1")
            window.keys("F1")
            window.close()
        finally:
            window.end()
    print("the window answered to mouse and keys, came to rest, and its shot renders")


def check(saved, program):
    """The shot says what the hand did, and renders."""
    text = saved.read_text()
    focus = [float(value) for value in re.findall(r"^focus-distance = ([0-9.]+)$", text.split("[[key]]", 1)[1], re.M)]
    frames = [float(value) for value in re.findall(r"^frame = ([0-9.]+)$", text, re.M)]
    if frames != [1, 48] or len(focus) != 2 or abs(focus[0] - focus[1]) < 0.01:
        raise SystemExit(f"the saved shot is not what was done:\n{text}")
    output = saved.parent / "out.####.exr"
    command = [program, "render", "--shot", saved, "-o", output, "--frames", "1-48x47", "--preset", "preview"]
    subprocess.run(list(map(str, command)), check=True, capture_output=True)
    first, last = (saved.parent / f"out.{frame:04}.exr" for frame in (1, 48))
    if first.read_bytes() == last.read_bytes():
        raise SystemExit("the focus does not move in what the shot renders to")


if __name__ == "__main__":
    main()
