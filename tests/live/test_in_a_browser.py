"""The page in headless Chromium."""

import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from browser import BROWSER, PATIENCE, Browser, Tab

from iowbc.commands.options import HOST
from iowbc.live.page import Page


@pytest.mark.slow
@pytest.mark.skipif(BROWSER is None, reason="chromium is not installed")
def test_the_tabs_of_a_browser_steer_one_robot(page: Page, tmp_path: Path) -> None:
    url = f"http://{HOST}:{page.server.get_port()}"
    page.server.scene.configure_default_lights(cast_shadow=False)  # slow where a processor draws

    def wait(what: Callable[[], bool]) -> None:
        until = time.monotonic() + PATIENCE
        while not what():
            assert time.monotonic() < until
            for _ in range(5):
                page.turn(time.monotonic())
                time.sleep(0.05)

    def titled(tab: Tab) -> bool:
        return "lift, 4 kg" in str(tab.evaluate("document.body ? document.body.innerText : ''"))

    def shown(tab: Tab) -> str:
        return str(tab.evaluate("[...document.querySelectorAll('input')].map(input => input.value).join()"))

    with Browser(tmp_path / "profile") as browser:
        first = browser.open(url)
        wait(lambda: titled(first))
        second = browser.open(url)
        wait(lambda: titled(second))
        second.evaluate("document.querySelectorAll('[role=slider]')[2].focus()")
        for _ in range(3):
            second.press("ArrowRight")
        wait(lambda: bool(np.isclose(page.session.wanted[0], 0.03)))
        first.ask("Page.bringToFront")
        wait(lambda: ",0.03," in shown(first))
