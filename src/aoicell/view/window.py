"""Shows a cell in browsers with viser: bodies, frames, a picture and a table."""

import html
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, redirect_stdout
from io import StringIO
from typing import Self

import numpy as np
import trimesh
import viser
from PIL import Image as Pictures
from trimesh.visual import TextureVisuals
from trimesh.visual.material import PBRMaterial

from aoicell.errors import InputError
from aoicell.sim.meshes import BodyShape, Print
from aoicell.transforms import SE3, to_quat_wxyz
from aoicell.view.address import browser_url, find_free
from aoicell.view.shown import Axes, Controls, Shown

EYE, AIM = (1.25, 2.35, 1.95), (-0.36, 0.72, 0.80)  # the first look, beside the panel (m)
TRUE_THICKNESS, ESTIMATE_THICKNESS = 0.03, 0.01  # radius of an axis over its length
ESTIMATE_LENGTH = 1.6  # of an estimate's axes over those of the truth
TRUE_ORIGIN, ESTIMATE_ORIGIN = (250, 250, 250), (230, 0, 180)
HEADING = "margin:0.9em 0 0.2em;font-weight:600;border-bottom:1px solid #8884"


class _Server(viser.ViserServer):
    """Without the way out: viser lets every browser ask for a tunnel to the internet."""

    def request_share_url(self, verbose: bool = True) -> str | None:
        """Nothing is shared."""
        return None


class Window:
    """Serves what it is shown until it is closed.

    `port` 0 takes the first free one from 8080 on. Raises InputError when host or port cannot
    be listened on.
    """

    def __init__(
        self, shapes: Sequence[BodyShape], controls: Controls, title: str,
        host: str = "127.0.0.1", port: int = 0,
    ) -> None:  # fmt: skip
        self.host, self.port = find_free(host, port)
        with _quiet():
            self._server = _Server(host=self.host, port=self.port, label=title, verbose=False)
        if self._server.get_port() != self.port:
            self.close()
            raise InputError(f"--port {self.port}: another program was quicker; try again")
        self._server.gui.configure_theme(
            control_layout="floating", control_width="large", show_logo=False,
            show_share_button=False,
        )  # fmt: skip
        self._server.initial_camera.position, self._server.initial_camera.look_at = EYE, AIM
        self._bodies = {shape.name: self._add_body(shape) for shape in shapes}
        self._axes: dict[tuple[str, bool], viser.FrameHandle] = {}
        self._wanted = {False: True, True: True}  # frames, by whether they are estimates
        self._last = Shown()
        self._lay_out(controls)

    @property
    def url(self) -> str:
        """Where a browser on this computer finds it."""
        return browser_url(self.host, self.port)

    def show(self, shown: Shown) -> None:
        """Replace what is shown; a browser gets the latest, however slow it is."""
        last, self._last = self._last, shown
        with self._server.atomic():
            for name, T in shown.Ts_world_body.items():
                if not _same(T, last.Ts_world_body.get(name)):
                    _place(self._bodies[name], T)
            self._show_axes(shown.axes)
            if shown.picture is not None and shown.picture is not last.picture:
                self._picture.image = shown.picture
                self._picture.visible = True
            if shown.caption != last.caption:
                self._caption.content = _as_html([("", shown.caption)])
            if list(shown.rows) != list(last.rows):
                self._table.content = _as_html(shown.rows)

    def wait_for_browser(self) -> None:
        """Return when a browser looks."""
        while not self._server.get_clients():
            time.sleep(0.1)

    def close(self) -> None:
        """Stop serving."""
        with _quiet():
            self._server.stop()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def _lay_out(self, controls: Controls) -> None:
        gui = self._server.gui
        self._picture = gui.add_image(_BLANK, format="jpeg", jpeg_quality=85, visible=False)
        self._caption = gui.add_html("")
        pause, step = gui.add_button("Pause"), gui.add_button("Step to the next picture")
        self._table = gui.add_html("")

        @pause.on_click
        def _(_: object) -> None:
            pause.label = "Go on" if controls.toggle() else "Pause"

        @step.on_click
        def _(_: object) -> None:
            controls.step()
            pause.label = "Go on"

        for estimates, label in ((False, "True frames (thick)"), (True, "Estimates (thin)")):
            box = gui.add_checkbox(label, initial_value=True)

            @box.on_update
            def _(
                _: object, box: viser.GuiInputHandle[bool] = box, estimates: bool = estimates
            ) -> None:
                self._wanted[estimates] = box.value
                self._show_axes(self._last.axes)

    def _add_body(self, shape: BodyShape) -> viser.FrameHandle:
        """An invisible frame that carries the body's meshes."""
        scene, path = self._server.scene, _path(shape.name)
        frame = scene.add_frame(path, show_axes=False)
        for index, solid in enumerate(shape.solids):
            scene.add_mesh_simple(
                f"{path}/solid_{index}", solid.vertices, solid.faces, color=solid.rgb,
                flat_shading=True, side="double",
            )  # fmt: skip
        for index, printed in enumerate(shape.prints):
            scene.add_mesh_trimesh(
                f"{path}/print_{index}", _textured(printed), cast_shadow=False
            )  # fmt: skip
        return frame

    def _show_axes(self, axes: Sequence[Axes]) -> None:
        for one in axes:
            key = one.name, one.estimate
            if key not in self._axes:
                self._axes[key] = self._add_axes(one)
            _place(self._axes[key], one.T_body_frame)
        named = {(one.name, one.estimate) for one in axes}
        for key, frame in self._axes.items():
            visible = key in named and self._wanted[key[1]]
            if frame.visible != visible:
                frame.visible = visible

    def _add_axes(self, axes: Axes) -> viser.FrameHandle:
        scene, kind = self._server.scene, "estimate" if axes.estimate else "true"
        path = f"{_path(axes.body)}/{kind}_{axes.name}"
        radius, length, origin = TRUE_THICKNESS * axes.length, axes.length, TRUE_ORIGIN
        if axes.estimate:
            radius, length = ESTIMATE_THICKNESS * axes.length, ESTIMATE_LENGTH * axes.length
            origin = ESTIMATE_ORIGIN
        frame = scene.add_frame(
            path, axes_length=length, axes_radius=radius, origin_radius=2 * radius,
            origin_color=origin,
        )  # fmt: skip
        if not axes.estimate:
            scene.add_label(f"{path}/label", axes.name, font_screen_scale=0.8)
        return frame


_BLANK = np.zeros((3, 4, 3), np.uint8)


@contextmanager
def _quiet() -> Iterator[None]:
    """Keep viser's greetings from stdout, which is for results."""
    with redirect_stdout(StringIO()):
        yield


def _path(body: str) -> str:
    """A body's place in the tree of the scene; a slash would mean a child there."""
    return f"/{body.replace('/', ' ')}"


def _same(T: SE3, other: SE3 | None) -> bool:
    return other is not None and bool(other == T)


def _place(frame: viser.FrameHandle, T: SE3) -> None:
    frame.wxyz, frame.position = to_quat_wxyz(T.rotation), T.translation


def _textured(printed: Print) -> trimesh.Trimesh:
    paper = PBRMaterial(
        baseColorTexture=Pictures.fromarray(printed.image), metallicFactor=0.0, roughnessFactor=1.0
    )
    look = TextureVisuals(uv=printed.uv, material=paper)
    return trimesh.Trimesh(printed.vertices, printed.faces, visual=look, process=False)


def _as_html(rows: Sequence[tuple[str, str]]) -> str:
    """Headings, and lines of label and value; every text escaped."""
    lines = []
    for label, value in rows:
        name, text = html.escape(label), html.escape(value)
        if not value:
            lines.append(f'<div style="{HEADING}">{name}</div>')
            continue
        if label:
            name = f'<span style="flex:0 0 7em;opacity:0.65">{name}</span>'
        lines.append(f'<div style="display:flex">{name}<span>{text}</span></div>')
    style = "padding:0 0.75em 0.5em;font-size:0.85em;line-height:1.5"
    return f'<div style="{style}">{"".join(lines)}</div>'
