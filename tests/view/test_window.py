"""The window in a real browser, and who else can reach it."""

import shutil
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from aoicell.errors import InputError
from aoicell.sim.meshes import BodyShape, Solid
from aoicell.transforms import SE3
from aoicell.view.shown import Axes, Shown

pytest.importorskip("viser", reason="the extra 'view' is not installed")

from aoicell.view.window import Window

CHROMIUM = shutil.which("chromium")
TRIANGLE = Solid(np.eye(3), np.array([[0, 1, 2]]), (200, 30, 30))
HARMLESS = "<img src=x onerror=document.title='run'> & 100 %"


class Buttons:
    def __init__(self) -> None:
        self.paused, self.steps = False, 0

    def toggle(self) -> bool:
        self.paused = not self.paused
        return self.paused

    def step(self) -> None:
        self.steps, self.paused = self.steps + 1, True


@pytest.fixture
def buttons() -> Buttons:
    return Buttons()


@pytest.fixture
def window(buttons: Buttons) -> Iterator[Window]:
    shapes = [BodyShape("world", (), ()), BodyShape("arm/part", (TRIANGLE,), ())]
    with Window(shapes, buttons, "a title") as window:
        yield window


def listening(port: int) -> set[str]:
    """The addresses, in the kernel's hexadecimal, at which anything listens on a port."""
    rows = [
        line.split()
        for table in ("tcp", "tcp6")
        for line in Path(f"/proc/net/{table}").read_text().splitlines()[1:]
    ]
    ends = [row[1].split(":") for row in rows if row[3] == "0A"]
    return {address for address, number in ends if int(number, 16) == port}


@pytest.mark.skipif(not Path("/proc/net/tcp").exists(), reason="/proc tells who listens")
def test_it_listens_on_the_loopback_address_alone(window: Window) -> None:
    assert listening(window.port) == {"0100007F"}  # 127.0.0.1


def test_a_port_that_is_taken_is_refused(window: Window, buttons: Buttons) -> None:
    with pytest.raises(InputError, match=f"--port {window.port}"):
        Window([], buttons, "another", port=window.port)


def test_a_second_window_finds_a_port_of_its_own(window: Window, buttons: Buttons) -> None:
    with Window([], buttons, "another") as second:
        assert second.port != window.port


def test_nothing_is_said_on_stdout(buttons: Buttons, capsys: pytest.CaptureFixture[str]) -> None:
    with Window([], buttons, "quiet"):
        pass
    assert capsys.readouterr().out == ""


def test_viser_gives_no_tunnel_to_the_internet(window: Window) -> None:
    assert window._server.request_share_url() is None
    assert window._server._share_tunnel is None


def shown() -> Shown:
    return Shown(
        Ts_world_body={"world": SE3.Identity(), "arm/part": SE3.Random()},
        axes=[
            Axes("tip", SE3.Identity(), "arm/part"),
            Axes("tip", SE3.Identity(), estimate=True),
        ],
        picture=np.full((30, 40, 3), 90, np.uint8),
        caption="hand camera, picture 1",
        rows=[("Trial 7", ""), ("phase", HARMLESS)],
    )


@pytest.mark.skipif(CHROMIUM is None, reason="there is no Chromium")
def test_it_opens_in_a_browser_and_obeys_its_buttons(window: Window, buttons: Buttons) -> None:
    playwright = pytest.importorskip("playwright.sync_api")
    asked: list[str] = []
    complaints: list[str] = []

    def listen(page: Any) -> None:
        page.on("request", lambda request: asked.append(request.url))
        page.on("websocket", lambda ws: asked.append(ws.url.replace("ws:", "http:")))
        page.on("console", lambda m: complaints.append(m.text) if m.type == "error" else None)
        page.on("pageerror", lambda error: complaints.append(str(error)))

    window.show(shown())
    with playwright.sync_playwright() as driver:
        browser = driver.chromium.launch(executable_path=CHROMIUM, args=["--no-sandbox"])
        page = browser.new_page(viewport={"width": 640, "height": 480})
        listen(page)
        page.goto(window.url)
        page.get_by_text("Trial 7").wait_for()
        window.wait_for_browser()
        assert page.get_by_text(HARMLESS).count() == 1, "shown as it stands"
        assert page.get_by_text("hand camera, picture 1").count() == 1
        page.get_by_role("button", name="Step to the next picture").click()
        page.get_by_role("button", name="Go on").click()
        page.get_by_role("button", name="Pause").wait_for()
        window.show(Shown(rows=[("Trial 8", "")]))
        page.get_by_text("Trial 8").wait_for()
        assert page.get_by_text("Trial 7").count() == 0
        assert page.title() != "run"
        browser.close()
    assert (buttons.steps, buttons.paused) == (1, False)
    local = (window.url, "data:", "blob:")
    assert [url for url in asked if not url.startswith(local)] == []
    assert complaints == []


def test_frames_come_and_go(window: Window) -> None:
    window.show(shown())
    assert {key: frame.visible for key, frame in window._axes.items()} == {
        ("tip", False): True,
        ("tip", True): True,
    }
    window.show(Shown(axes=[Axes("tip", SE3.Identity(), "arm/part")]))
    assert not window._axes["tip", True].visible
    assert window._axes["tip", False].visible
