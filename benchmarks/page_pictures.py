"""`python -m benchmarks.page_pictures` makes the pictures of pages in docs/pictures anew, by a headless Chromium."""

from __future__ import annotations

import base64
import shlex
import shutil
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any, NamedTuple

from selenium import webdriver

PICTURES = Path(__file__).parents[1] / "docs" / "pictures"
DALEMBERT = str(Path(sys.executable).with_name("dalembert"))


class Picture(NamedTuple):
    """A page as it is opened and set."""

    name: str
    example: str
    command: str
    size: tuple[int, int]
    script: str = ""


KLANN = "mechanism klann.toml --over 0deg:360deg:1deg"
LONGER = "dalembert.set({'links.crank.B.x': 0.14, input: 1.9})"
FIELD = "field fan.csv --reading-error 2%,2deg --blades 16 --grade G2.5 --speed 1490rpm --rotor-mass 120kg --radius 400mm"
AFTER = (
    "const deg = Math.PI / 180; dalembert.set({'initial/bearing/amplitude': 4.1, 'initial/bearing/phase': 70 * deg,"
    " 'run 2/bearing/amplitude': 0.62, 'run 2/bearing/phase': 25 * deg, 'run 2/1/mass': 0.0022, 'run 2/1/angle': 290 * deg})"
)
ROTOR = "balance rotor.csv --plane A:0mm:20mm --plane B:90mm:20mm --gravity 10 --grade G6.3 --speed 1500rpm --rotor-mass 60kg"
PICTURED = (
    Picture("klann-page", "klann", KLANN, (1000, 640), LONGER),
    Picture("klann-phone", "klann", KLANN, (360, 720), LONGER),
    Picture("balance-page", "riul-rotor", ROTOR, (1000, 640)),
    Picture("field-page", "fan-one-plane", FIELD, (1000, 760), AFTER),
    Picture("field-phone", "fan-one-plane", FIELD, (360, 1480), AFTER),
)


def taken(browser: Any, picture: Picture) -> bytes:
    """One picture as the bytes of a PNG."""
    width, height = picture.size
    screen = {"width": width, "height": height, "deviceScaleFactor": 1.5, "mobile": width < 500}
    with tempfile.TemporaryDirectory() as folder:
        for words in (["examples", picture.example], [*shlex.split(picture.command), "--page", "page.html"]):
            subprocess.run([DALEMBERT, *words], cwd=folder, check=True, capture_output=True)
        browser.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", screen)
        browser.get((Path(folder) / "page.html").as_uri())
        browser.execute_script(f"{picture.script}; scrollTo(0, 0)")
        time.sleep(0.5)  # limits are found a little later
        return base64.b64decode(browser.execute_cdp_cmd("Page.captureScreenshot", {})["data"])


def main() -> None:
    """Make every picture."""
    options = webdriver.ChromeOptions()
    options.binary_location = shutil.which("chromium") or ""
    for argument in ("--headless=new", "--no-sandbox", "--hide-scrollbars"):
        options.add_argument(argument)
    service = webdriver.ChromeService(executable_path=shutil.which("chromedriver"))
    browser = webdriver.Chrome(options=options, service=service)
    try:
        for picture in PICTURED:
            (PICTURES / f"{picture.name}.png").write_bytes(taken(browser, picture))
    finally:
        browser.quit()


if __name__ == "__main__":
    main()
