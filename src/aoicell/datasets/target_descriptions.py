"""What a manifest says about a calibration target: kind, counts and sizes in mm."""

from typing import Annotated, Any, Literal

from pydantic import BaseModel, ConfigDict, Field, field_validator, model_validator

from aoicell.errors import did_you_mean
from aoicell.targets.apriltag import FAMILIES
from aoicell.targets.fiducials import DICTIONARIES

Mount = Literal["eye_in_hand", "eye_to_hand"]
Count = Annotated[int, Field(ge=2, le=200)]
Millimetres = Annotated[float, Field(gt=0, le=5000, allow_inf_nan=False)]
Name = Annotated[str, Field(pattern=r"^\w[\w .-]*$", max_length=100)]


class Strict(BaseModel):
    """A table whose unknown keys and ill-fitting types are refused."""

    model_config = ConfigDict(frozen=True, extra="forbid", strict=True)


class _Described(Strict):
    """What every target may say: a name, who sees it, and a mount other than the recording's.

    `camera` is one camera's name or a list of several. A target of the mount `eye_in_hand` stands
    in the base, one of `eye_to_hand` is carried by the arm, whichever camera looks at it.
    `size_percent` and `flatness_mm` are standard deviations of the print's size and of its
    plate's heights, for targets better or worse than a laser printer's sheet on a plate.
    """

    name: Name | None = None
    camera: Annotated[list[Name], Field(min_length=1)] | None = None
    mount: Mount | None = None
    size_percent: Annotated[float, Field(gt=0, le=10, allow_inf_nan=False)] | None = None
    flatness_mm: Annotated[float, Field(gt=0, le=100, allow_inf_nan=False)] | None = None

    @field_validator("camera", mode="before")
    @classmethod
    def _one_or_several(cls, value: Any) -> Any:
        return [value] if isinstance(value, str) else value

    @field_validator("camera")
    @classmethod
    def _once(cls, value: list[str] | None) -> list[str] | None:
        twice = [name for name in value or [] if (value or []).count(name) > 1]
        if twice:
            raise ValueError(f"{twice[0]!r} stands twice")
        return value


class _Grid(_Described):
    """A target whose parts stand in columns and rows."""

    columns: Count
    rows: Count


class _Coded(_Grid):
    """A target of markers from one of OpenCV's predefined dictionaries."""

    dictionary: str

    @field_validator("dictionary")
    @classmethod
    def _known(cls, value: str) -> str:
        if value not in DICTIONARIES:
            raise ValueError(f"that is no dictionary; {did_you_mean(value, DICTIONARIES)}")
        return value


class ChessboardDescription(_Grid):
    """A chessboard; `columns` and `rows` count inner corners."""

    kind: Literal["chessboard"]
    square_mm: Millimetres


class CharucoDescription(_Coded):
    """A ChArUco board; `columns` and `rows` count squares.

    `legacy`: printed with the pattern of OpenCV before 4.6, which starts with a white square when
    the number of rows is even; only then does it matter, and then it has to be said.
    """

    kind: Literal["charuco"]
    square_mm: Millimetres
    marker_mm: Millimetres
    legacy: bool | None = None

    @model_validator(mode="after")
    def _possible(self) -> "CharucoDescription":
        if self.marker_mm >= self.square_mm:
            raise ValueError(
                f"marker_mm = {self.marker_mm:g} has to be below square_mm = {self.square_mm:g}"
            )
        if self.legacy is None and self.rows % 2 == 0:
            raise ValueError(
                f"legacy is missing; with an even number of rows ({self.rows}) give true for "
                "a print of OpenCV before 4.6 (its top left square is white), else false"
            )
        return self


class ArucoGridDescription(_Coded):
    """A grid of ArUco markers, `gap_mm` apart, numbered row by row from `first_id`."""

    kind: Literal["aruco_grid"]
    marker_mm: Millimetres
    gap_mm: Millimetres
    first_id: Annotated[int, Field(ge=0, le=100_000)] = 0


class CircleGridDescription(_Grid):
    """A grid of dots, `spacing_mm` apart; `origin_dot`: a larger one marks the origin.

    `asymmetric` is OpenCV's staggered grid: `spacing_mm` between rows, twice as much in a row.
    """

    kind: Literal["circle_grid"]
    spacing_mm: Millimetres
    origin_dot: bool
    asymmetric: bool = False


class AprilTagDescription(_Described):
    """One AprilTag, or a grid of them `gap_mm` apart.

    `tag_mm` is the side of the black square. A grid is numbered row by row from `first_id`, from
    the top left, or with `from_bottom` from the bottom left upwards; that has to be said.
    """

    kind: Literal["apriltag"]
    tag_mm: Millimetres
    family: str
    columns: Annotated[int, Field(ge=1, le=200)] = 1
    rows: Annotated[int, Field(ge=1, le=200)] = 1
    gap_mm: Millimetres | None = None
    from_bottom: bool | None = None
    first_id: Annotated[int, Field(ge=0, le=100_000)] = 0

    @field_validator("family")
    @classmethod
    def _known(cls, value: str) -> str:
        if value not in FAMILIES:
            raise ValueError(f"that is no family of tags; {did_you_mean(value, FAMILIES)}")
        return value

    @model_validator(mode="after")
    def _complete(self) -> "AprilTagDescription":
        if self.columns * self.rows > 1 and self.gap_mm is None:
            raise ValueError("gap_mm is missing; a grid of tags needs the white between two")
        if self.rows > 1 and self.from_bottom is None:
            raise ValueError(
                "from_bottom is missing; give true where the lowest id stands at the bottom "
                "left (Kalibr), false where it stands at the top left"
            )
        return self


TargetDescription = Annotated[
    ChessboardDescription
    | CharucoDescription
    | ArucoGridDescription
    | CircleGridDescription
    | AprilTagDescription,
    Field(discriminator="kind"),
]

KINDS: dict[str, type[BaseModel]] = {
    "chessboard": ChessboardDescription,
    "charuco": CharucoDescription,
    "aruco_grid": ArucoGridDescription,
    "circle_grid": CircleGridDescription,
    "apriltag": AprilTagDescription,
}
