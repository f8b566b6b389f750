#!/usr/bin/env python3
"""The live scene's real window from end to end, as window.py does it with the viewer's.

    .ci/live.py PROGRAM

focuses by a click, changes the f-stop, orbits, comes nearer, changes size down to nearly nothing, and ends by Escape; its title
says what it does.
"""

import pathlib
import re
import sys
import tempfile
import time

from window import Window


class Live(Window):
    def title(self):
        found = self.tool("search", "--onlyvisible", "--name", r"pullfocus|f/", check=False).splitlines()
        return self.tool("getwindowname", found[-1], check=False) if found else ""

    def says(self, pattern):
        """Waits until the title has this in it; a software driver needs a while for a frame."""
        self.wait_for(lambda: re.search(pattern, self.title()), 120)

    def focus(self):
        return float(re.match(r"[0-9.]+", self.title()).group())

    def settled(self):
        """The focus, once it stays where it is."""
        def still():
            before = self.focus()
            # A click is answered a frame or two later, and a frame may take half a second.
            for _ in range(4):
                time.sleep(0.7)
                if self.focus() != before:
                    return False
            return True
        self.wait_for(still, 60)
        return self.focus()

    def resize(self, width, height):
        self.tool("windowsize", self.id, width, height)
        time.sleep(0.5)


def main():
    program = pathlib.Path(sys.argv[1]).resolve()
    with tempfile.TemporaryDirectory() as home:
        window = Live(program, home, None)
        try:
            window.launch("--size", 320, 180)
            window.says(r"^0\.4[78] m  f/2\.8 .* (diffusion|aperture)")
            window.id = window.tool("search", "--onlyvisible", "--name", "f/").splitlines()[-1]
            window.wait_for(lambda: window.take_keyboard("f/"))
            window.tool("key", "bracketright")
            window.says(r"f/3\.1")
            window.tool("key", "f")
            window.says("one picture")
            window.tool("key", "space")
            window.says("no lens")
            # The far king, then the near queen.
            window.tool("mousemove", 294, 80, "click", 1)
            window.wait_for(lambda: window.focus() > 0.6, 30)
            window.tool("mousemove", 16, 130, "click", 1)
            window.wait_for(lambda: window.focus() < 0.45, 30)
            # A drag is no click, even where it ends on something else.
            before = window.settled()
            window.tool("mousemove", 160, 90, "mousedown", 1)
            for x in range(160, 260, 20):
                window.tool("mousemove", x, 100)
                time.sleep(0.1)
            window.tool("mouseup", 1)
            if window.settled() != before:
                raise SystemExit("a drag has focused")
            # From nearer by, the same place of the window is nearer.
            window.tool("mousemove", 60, 160, "click", 1)
            before = window.settled()
            window.tool("click", "--repeat", 3, 4)
            time.sleep(1)
            window.tool("click", 1)
            window.wait_for(lambda: window.focus() < before, 30)
            for size in [(1, 1), (257, 131), (320, 180)]:
                window.resize(*size)
            window.tool("key", "space")
            window.says("diffusion|aperture")
            window.tool("key", "Escape")
            if window.process.wait(30) != 0:
                raise SystemExit("the window did not end well")
        finally:
            window.end()
    print("the live scene answered to mouse and keys, at every size")


if __name__ == "__main__":
    main()
