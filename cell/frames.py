"""Draw frames.png: every frame of the project on the cell as designed, and the chain between them.

python cell/frames.py
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle
from matplotlib.patheffects import withStroke
from picture import HEIGHT, WIDTH, over_the_board, softly_lit

from aoicell.nominal import Nominal, load_nominal
from aoicell.observation import Image
from aoicell.sim.drawing import draw
from aoicell.sim.tolerances import Tolerances
from aoicell.sim.world import World
from aoicell.transforms import SE3, Array, apply, to_quat_wxyz

HERE = Path(__file__).parent
DPI = 100
FADE = 0.30  # how far the render goes towards white, so that the drawing stands out
AXES = {"x": "#d81e1e", "y": "#00962f", "z": "#1450e6"}
INK, ARROW = "#111111", "#3d2a78"
NAME_PT, ARROW_PT = 18, 15.5


@dataclass(frozen=True)
class Shot:
    """A render and the pinhole that took it. MuJoCo's camera looks along -z with y up."""

    image: Image
    T_world_eye: SE3
    fovy_deg: float

    def project(self, ps_world: Array) -> Array:
        """Pixels (N, 2) of points (N, 3) in world (m)."""
        x, y, z = apply(self.T_world_eye.inverse(), ps_world).T
        height, width = self.image.shape[:2]
        focal = height / 2 / np.tan(np.radians(self.fovy_deg) / 2)
        middle = np.array([width - 1, height - 1]) / 2
        return np.asarray(middle + focal * np.column_stack([x, -y]) / -z[:, None])


@dataclass(frozen=True)
class Triad:
    """A frame to draw: the length of its axes (m), its label's offset from the origin (px)."""

    frame: str
    length: float
    dx: float
    dy: float


@dataclass(frozen=True)
class Link:
    """The arrow of T_<parent>_<child>: bend, label's place along it and offset from there (px)."""

    parent: str
    child: str
    bend: float
    along: float
    dx: float
    dy: float


@dataclass(frozen=True)
class Inset:
    """A nearer view: the point of a frame that it aims at (m), whence in world and how far (m),
    its place in the figure (left, top, width, height, px), what is drawn in it.
    """

    frame: str
    aim: tuple[float, float, float]
    whence: tuple[float, float, float]
    distance: float
    place_px: tuple[int, int, int, int]
    triads: tuple[Triad, ...]
    links: tuple[Link, ...]

    def camera(self, frames: dict[str, SE3]) -> SE3:
        """T_world_eye, upright."""
        back = np.array(self.whence) / np.linalg.norm(self.whence)
        right = np.cross([0, 0, 1], back)
        right /= np.linalg.norm(right)
        R = np.column_stack([right, np.cross(back, right), back])
        return SE3(R, frames[self.frame].act(np.array(self.aim)) + self.distance * back)


TRIADS = (
    Triad("world", 0.20, -75, 45),
    Triad("base", 0.20, -80, -25),
    Triad("tripod", 0.18, 85, 0),
    Triad("tabletarget", 0.12, 130, 0),
    Triad("board", 0.12, 95, 60),
)
LINKS = (
    Link("world", "base", -0.25, 0.5, -104, 8),
    Link("base", "flange", -0.12, 0.55, -108, 24),
    Link("base", "tripod", 0.0, 0.72, -110, -8),
    Link("base", "tabletarget", 0.08, 0.8, 105, 72),
    Link("base", "board", 0.0, 0.4, 36, 68),
    Link("camera", "board", -0.16, 0.4, 96, 0),
)
HAND = Inset(
    "flange", (0, -0.09, -0.01), (-0.25, 0.90, 0.50), 0.50, (16, 16, 510, 420),
    (
        Triad("flange", 0.06, -75, -28),
        Triad("camera", 0.06, -75, 38),
        Triad("armtarget", 0.06, 30, 92),
    ),
    (Link("flange", "camera", -0.6, 0.5, 112, 36), Link("flange", "armtarget", 0.0, 0.5, 0, -60)),
)  # fmt: skip
BOARD = Inset(
    "board", (0, 0, 0), (0.70, 0.72, 1.0), 0.66, (1164, 584, 420, 400),
    (Triad("board", 0.06, 0, 60), Triad("marker", 0.05, 0, -60)),
    (Link("board", "marker", 0.0, 0.5, 115, 0),),
)  # fmt: skip


def main() -> None:
    """Write the figure."""
    nominal = load_nominal(HERE)
    world = World(nominal, draw(nominal, Tolerances(), seed=0))
    world.arrive(over_the_board(nominal))
    frames = true_frames(world, nominal)
    overview = take(world)
    near = [(inset, take(world, inset.camera(frames))) for inset in (HAND, BOARD)]
    compose(frames, overview, near).savefig(HERE / "frames.png", pil_kwargs={"optimize": True})


def true_frames(world: World, nominal: Nominal) -> dict[str, SE3]:
    """Poses in world of all frames, by name."""
    bodies = {"flange": "arm/flange", "camera": "hand"}
    bodies |= {name: name for name in ("tripod", "armtarget", "tabletarget", "board")}
    T_world_base = nominal.T_world_base
    frames = {frame: T_world_base * world.T_base_body(body) for frame, body in bodies.items()}
    marker = frames["board"] * nominal.T_board_positioning
    return {"world": SE3.Identity(), "base": T_world_base, "marker": marker, **frames}


def take(world: World, T_world_eye: SE3 | None = None) -> Shot:
    """Render from the camera `overview`, first moved to T_world_eye if one is given."""
    camera = world.model.camera("overview")
    if T_world_eye is not None:
        camera.pos[:] = T_world_eye.translation
        camera.quat[:] = to_quat_wxyz(T_world_eye.rotation)
    image = softly_lit(world)  # this brings data.cam_xpos up to date
    pose = world.data.camera("overview")
    T_world_eye = SE3(pose.xmat.reshape(3, 3).copy(), pose.xpos.copy())
    return Shot(image, T_world_eye, float(camera.fovy[0]))


def compose(frames: dict[str, SE3], overview: Shot, near: list[tuple[Inset, Shot]]) -> Figure:
    """The overview and the insets with their drawing, and the key."""
    figure = Figure(figsize=(WIDTH / DPI, HEIGHT / DPI), dpi=DPI)
    FigureCanvasAgg(figure)
    whole = figure.add_axes((0, 0, 1, 1))
    show(whole, overview.image, WIDTH)
    whole.set_axis_off()
    for inset, _ in near:
        tie(whole, overview, frames, inset)
    draw_triads(whole, overview, frames, TRIADS)
    draw_links(whole, overview, frames, LINKS)
    draw_key(whole)
    for inset, shot in near:
        left, top, width, height = inset.place_px
        axes = figure.add_axes(
            (left / WIDTH, 1 - (top + height) / HEIGHT, width / WIDTH, height / HEIGHT)
        )
        show(axes, shot.image, HEIGHT * width / height)
        axes.spines[:].set(linewidth=2, color=INK)
        draw_triads(axes, shot, frames, inset.triads)
        draw_links(axes, shot, frames, inset.links)
    return figure


def show(axes: Axes, image: Image, width: float) -> None:
    """Fill the axes with the middle columns of a faded render; the data are its pixels."""
    pale = np.rint(image * (1 - FADE) + 255 * FADE).astype(np.uint8)
    axes.imshow(pale, aspect="auto", interpolation="antialiased")
    middle = (image.shape[1] - 1) / 2
    axes.set(xlim=(middle - width / 2, middle + width / 2), ylim=(len(image) - 0.5, -0.5))
    axes.set(xticks=[], yticks=[])


def draw_triads(axes: Axes, shot: Shot, frames: dict[str, SE3], triads: tuple[Triad, ...]) -> None:
    """Axes x red, y green, z blue from each origin, and the frame's name."""
    for triad in triads:
        tips = triad.length * np.vstack([np.zeros(3), np.eye(3)])
        origin, *ends = shot.project(apply(frames[triad.frame], tips))
        # the axis that comes nearest to the eye is drawn last
        depth = (shot.T_world_eye.inverse() * frames[triad.frame]).rotation[2]
        for n in np.argsort(depth):
            arrow(axes, origin, ends[n], list(AXES.values())[n], width=3.2, head=11)
        axes.plot(*origin, "o", color=INK, markersize=6, markeredgecolor="white", zorder=6)
        write(axes, origin, (triad.dx, triad.dy), triad.frame, INK, NAME_PT, bold=True)


def draw_links(axes: Axes, shot: Shot, frames: dict[str, SE3], links: tuple[Link, ...]) -> None:
    """A thin arrow from parent to child, and its name."""
    for link in links:
        origins = np.array([frames[link.parent].translation, frames[link.child].translation])
        start, end = shot.project(origins)
        arrow(axes, start, end, ARROW, width=1.8, head=16, bend=link.bend)
        # the bent arrow is a parabola whose height is half the bend
        chord, t = end - start, link.along
        place = start + t * chord + 2 * t * (1 - t) * link.bend * np.array([-chord[1], chord[0]])
        name = f"T_{link.parent}_{link.child}"
        write(axes, place, (link.dx, link.dy), name, ARROW, ARROW_PT)


def arrow(
    axes: Axes, start: Array, end: Array, colour: str, width: float, head: float, bend: float = 0.0
) -> None:
    """An arrow with a white rim between two pixels; `bend` as a share of its length."""
    axes.annotate(
        "", (end[0], end[1]), (start[0], start[1]), zorder=5,
        arrowprops={
            "arrowstyle": "-|>", "color": colour, "linewidth": width, "mutation_scale": head,
            "shrinkA": 0, "shrinkB": 0, "connectionstyle": f"arc3,rad={bend}",
            "path_effects": [withStroke(linewidth=width + 2.4, foreground="white")],
        },
    )  # fmt: skip


def write(
    axes: Axes,
    place: Array,
    offset: tuple[float, float],
    text: str,
    colour: str,
    points: float,
    bold: bool = False,
    ha: Literal["left", "center"] = "center",
) -> None:
    """Text with a white rim, its middle at an offset (figure px, y down) from a place."""
    axes.annotate(
        text, (place[0], place[1]), (offset[0] * 72 / DPI, -offset[1] * 72 / DPI),
        textcoords="offset points",
        ha=ha, va="center", color=colour, fontsize=points, zorder=9,
        family="DejaVu Sans" if bold else "DejaVu Sans Mono",
        weight="bold" if bold else "normal",
        path_effects=[withStroke(linewidth=4.5, foreground="white")],
    )  # fmt: skip


def tie(axes: Axes, overview: Shot, frames: dict[str, SE3], inset: Inset) -> None:
    """A box around what an inset shows, and lines from its corners to the inset's."""
    names = [triad.frame for triad in inset.triads]
    spots = overview.project(np.array([frames[name].translation for name in names]))
    low, high = spots.min(axis=0) - 40, spots.max(axis=0) + 40
    axes.add_patch(Rectangle(low, *(high - low), fill=False, edgecolor=INK, linewidth=1.4))
    left, top, width, height = inset.place_px
    is_left = left < low[0]
    x_box, x_inset = (low[0], left + width) if is_left else (high[0], left)
    for y_box, y_inset in ((low[1], top), (high[1], top + height)):
        axes.plot([x_box, x_inset], [y_box, y_inset], color=INK, linewidth=0.9, alpha=0.6)


def draw_key(axes: Axes) -> None:
    """The axes' colours and how the names chain."""
    left, top, line = 40, 794, 38
    for n, (name, colour) in enumerate(AXES.items()):
        write(axes, np.array([left + 10 + 45 * n, top]), (0, 0), name, colour, NAME_PT, bold=True)
    lines = (
        "T_a_b: the pose of b in a",
        "marker: the positioning marker, M1",
        "T_base_board = T_base_flange",
        "  * T_flange_camera * T_camera_board",
    )
    for n, text in enumerate(lines, start=1):
        write(axes, np.array([left, top + n * line]), (0, 0), text, ARROW, ARROW_PT, ha="left")


if __name__ == "__main__":
    main()
