"""Opens a report page in Chromium, from its file and without a network: report_page_test.py CHROMIUM WRITER FOLDER

WRITER makes page.html in FOLDER. The page must load without a message on the console, and its yarns must be drawn.
"""
import pathlib
import re
import subprocess
import sys
import tempfile
import unittest

from vtkmodules.util.numpy_support import vtk_to_numpy
from vtkmodules.vtkIOImage import vtkPNGReader

CHROMIUM, WRITER, FOLDER = sys.argv[1], sys.argv[2], pathlib.Path(sys.argv[3])
WIDTH, HEIGHT = 1000, 2000
# Where the canvas is, for the reader of the picture; the page's own script has run by then.
PROBE = """<script>addEventListener("load", () => {
  const box = document.querySelector("canvas").getBoundingClientRect();
  document.body.dataset.canvas = [box.left, box.top, box.right, box.bottom].map(Math.round).join(" ");
});</script>"""


def chromium(page, *options):
    """Standard output and the messages on the console."""
    with tempfile.TemporaryDirectory() as profile:
        run = subprocess.run(
            [CHROMIUM, "--headless", "--no-sandbox", "--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--disable-dev-shm-usage",
             "--host-resolver-rules=MAP * ~NOTFOUND", f"--user-data-dir={profile}", "--enable-logging=stderr", "--virtual-time-budget=3000",
             f"--window-size={WIDTH},{HEIGHT}", "--hide-scrollbars", *options, page.as_uri()],
            capture_output=True, text=True, timeout=120, check=True)
    return run.stdout, re.findall(r"CONSOLE.*", run.stderr)


class ReportPage(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        FOLDER.mkdir(parents=True, exist_ok=True)
        cls.page = FOLDER / "page.html"
        subprocess.run([WRITER, FOLDER], check=True)
        if "three.js (Debian: libjs-three) was not found" in cls.page.read_text():
            raise unittest.SkipTest("three.js is not installed")
        probed = FOLDER / "probed.html"
        probed.write_text(cls.page.read_text() + PROBE)
        cls.dom, cls.messages = chromium(probed, "--dump-dom")

    def test_console_is_silent(self):
        self.assertEqual(self.messages, [])

    def test_yarns_are_drawn(self):
        left, top, right, bottom = map(int, re.search(r'data-canvas="([^"]*)"', self.dom).group(1).split())
        self.assertLessEqual(bottom, HEIGHT)
        picture = FOLDER / "page.png"
        chromium(self.page, f"--screenshot={picture}")
        reader = vtkPNGReader()
        reader.SetFileName(str(picture))
        reader.Update()
        image = reader.GetOutput()
        columns, rows, _ = image.GetDimensions()
        self.assertEqual((columns, rows), (WIDTH, HEIGHT))
        pixels = vtk_to_numpy(image.GetPointData().GetScalars()).reshape(rows, columns, -1)[::-1, :, :3]  # VTK counts rows from below
        canvas = pixels[top + 2 : bottom - 2, left + 2 : right - 2].reshape(-1, 3).astype(int)
        self.assertGreater(len(canvas), 10000)
        background = canvas[0]  # in the corner
        drawn = canvas[abs(canvas - background).max(axis=1) > 20]
        self.assertGreater(len(drawn), 0.05 * len(canvas))
        self.assertLess(len(drawn), 0.95 * len(canvas))
        # Lit from one side, surfaces have many shades; warps and wefts have two colors: one red before blue, one blue before red.
        self.assertGreater(len({tuple(p) for p in drawn}), 50)
        red_less_blue = drawn[:, 0] - drawn[:, 2]
        self.assertGreater((red_less_blue > 20).mean(), 0.1)
        self.assertGreater((red_less_blue < -20).mean(), 0.1)


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1])
