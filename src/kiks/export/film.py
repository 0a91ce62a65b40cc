"""Makes films of recordings."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from pathlib import Path

import numpy as np

from kiks.errors import ParameterError, library, shown
from kiks.export.kinds import FILMS
from kiks.export.panel import FilmPanel
from kiks.export.solid_stage import SolidStage
from kiks.export.stage import Pixels, Stage
from kiks.export.video_file import GIF, MP4, write_film
from kiks.model.atomic_files import ending_of
from kiks.model.checks import check_choice, check_count, check_number
from kiks.recording.moments import moments
from kiks.recording.recording import Recording
from kiks.units import NS_PER_S, s_from_ns

SIZE, FPS = (1280, 720), 25
"""Width and height of a film, and its pictures per second, if nothing else is asked for."""

SIDE_MIN, SIDE_MAX = 64, 4096
"""Least and most pixels of a side."""

FPS_MAX, GIF_FPS_MAX = 120, 50
"""Most pictures per second; browsers show a GIF with more of them slower than it is."""

SPEED_MIN, SPEED_MAX = 0.001, 1000.0
"""Least and most simulated seconds per second of a film."""

ZOOM, ZOOM_MAX = 3.0, 20.0
"""Zoom of a film that follows a robot, and the most."""

VIEWS: dict[str, type[Stage | SolidStage]] = {"top": Stage, "3d": SolidStage}

PICTURES_MAX = 1_000_000
"""Most pictures of a film."""


def save_film(
    recording: Recording,
    path: str | Path,
    *,
    size: tuple[int, int] = SIZE,
    fps: int = FPS,
    speed: float = 1.0,
    start_s: float | None = None,
    end_s: float | None = None,
    robot: int | None = None,
    follow: int | None = None,
    zoom: float | None = None,
    view: str = "top",
    is_plain: bool = False,
    on_progress: Callable[[float], object] = lambda share: None,
) -> int:
    """Make a film of a recording: the world from above with trails, and what a robot reads beside it.

    Args:
        recording: The recording.
        path: The film's file: .mp4 (H.264), .gif or .webp.
        size: Width and height [pixels]; of an MP4, an odd one becomes one less.
        fps: Pictures per second.
        speed: Simulated seconds per second of the film.
        start_s: Where it begins [s]; the beginning of the recording if left out.
        end_s: Where it ends [s]; the end of the recording if left out.
        robot: Number of the robot whose readings are shown; the followed one, else 1, if left out.
        follow: Number of the robot that stays in the middle; if left out, the whole arena is seen.
        zoom: Magnification, 1 to 20, with `follow` alone; 1 fits the whole arena, 3 if left out.
        view: 'top', from above, or '3d', in space; that needs VTK.
        is_plain: Whether the world is alone, without trails, clock and readings; then `robot` is left out.
        on_progress: Called after each picture with the share that is done.

    Returns:
        The number of pictures.

    Example:
        >>> import tempfile, kiks
        >>> folder = Path(tempfile.mkdtemp())
        >>> sim = kiks.Simulation(kiks.Arena.box(300, 300))
        >>> with sim.record(folder / "run.mcap"):
        ...     sim.run(1.0)
        >>> save_film(Recording(folder / "run.mcap"), folder / "run.webp", size=(160, 120), fps=10)
        11
    """
    (width, height), fps, speed = checked_format(path, size, fps, speed)
    check_choice("view", view, VIEWS)
    follow, zoom = checked_follow(recording, follow, zoom)
    if is_plain and robot is not None:
        raise ParameterError(f"robot must be left out of a plain film, but it was {shown(robot)}.")
    # Without robots, nothing is read.
    robot = follow or 1 if robot is None else recording.check_robot(robot)
    times_ns = _times_ns(recording, start_s, end_s, speed / fps)

    def pictures(times_ns: Sequence[int]) -> Iterator[Pixels]:
        picture = np.zeros((height, width, 3), np.uint8)
        panel = None if is_plain else FilmPanel((width, height), robot=robot - 1, speed=speed, title=recording.what)
        left = width - (0 if panel is None else panel.width)
        index = None if follow is None else follow - 1
        stage = VIEWS[view]((left, height), follow=index, zoom=zoom, has_trails=not is_plain)
        for number, moment in enumerate(moments(recording.log, times_ns)):
            stage.draw(moment, number / len(times_ns), picture[:, :left])
            if panel is not None:
                panel.draw(moment, picture)
            yield picture

    write_film(path, (width, height), fps, times_ns, pictures, on_progress)
    return len(times_ns)


def check_film(path: str | Path) -> str:
    """Return the ending of a film's file."""
    library("av", "film")
    return ending_of(path, "a film", FILMS)


def checked_format(path: str | Path, size: object, fps: object, speed: object) -> tuple[tuple[int, int], int, float]:
    """Return size, pictures per second and speed of a film, as files with the path's ending have them."""
    ending = check_film(path)
    width, height = checked_size(size)
    if ending == MP4:
        # H.264 halves the resolution of colours.
        width, height = width // 2 * 2, height // 2 * 2
    fps = check_count("fps", fps, 1, GIF_FPS_MAX if ending == GIF else FPS_MAX)
    return (width, height), fps, check_number("speed", speed, SPEED_MIN, SPEED_MAX)


def checked_size(size: object) -> tuple[int, int]:
    """Return the size of a film."""
    if not isinstance(size, Sequence) or len(size) != 2:
        raise ParameterError(f"size must be a width and a height, but it was {shown(size)}. Give (1280, 720).")
    width = check_count("the width of size", size[0], SIDE_MIN, SIDE_MAX)
    return width, check_count("the height of size", size[1], SIDE_MIN, SIDE_MAX)


def checked_follow(recording: Recording, follow: object, zoom: object) -> tuple[int | None, float]:
    """Return the number of the followed robot, and the zoom."""
    if follow is None and zoom is not None:
        raise ParameterError(f"zoom must be left out where no robot is followed, but it was {shown(zoom)}. Add follow.")
    if follow is None:
        return None, 1.0
    return recording.check_robot(follow, name="follow"), check_number(
        "zoom", ZOOM if zoom is None else zoom, 1.0, ZOOM_MAX
    )


def _times_ns(recording: Recording, start_s: float | None, end_s: float | None, step_s: float) -> list[int]:
    """Return the instants of the pictures [ns]: from the beginning on, up to the end."""
    log = recording.log
    begin_ns = log.begin_ns if start_s is None else recording.time_ns(start_s, "start_s")
    end_ns = log.end_ns if end_s is None else recording.time_ns(end_s, "end_s")
    if begin_ns >= end_ns:
        raise ParameterError(
            f"a film must end after it begins, but it begins at {s_from_ns(begin_ns):g} s and ends at "
            f"{s_from_ns(end_ns):g} s. The recording goes from {s_from_ns(log.begin_ns):g} to "
            f"{s_from_ns(log.end_ns):g} s."
        )
    step_ns = step_s * NS_PER_S
    count = int((end_ns - begin_ns) / step_ns + 1e-6) + 1
    check_picture_count(count, "less of the recording")
    return [min(begin_ns + round(number * step_ns), end_ns) for number in range(count)]


def check_picture_count(count: int, less: str) -> None:
    """Check how many pictures a film would have; `less` says what else to choose."""
    if count > PICTURES_MAX:
        raise ParameterError(
            f"a film must have at most {PICTURES_MAX} pictures, but it would have {count}. Choose {less}, or a greater "
            "speed."
        )
