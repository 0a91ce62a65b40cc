"""A drawing of a sensor's seven rays: their lengths, what they hit, and their contributions to the reading."""

from __future__ import annotations

import math
from html import escape

from kiks.export.looks import css
from kiks.sim.colours import BALL_COLOUR, CYLINDER_COLOUR, robot_colour
from kiks.sim.explanation import Explanation, SeenRay

_REACH = 150.0
_COLOURS = {"wall": "#8a6d3b", "ball": css(BALL_COLOUR), "cylinder": css(CYLINDER_COLOUR)}
_RANGES_MM = (6.0, 15.0, 30.0, 60.0)
_THIN, _THICK = 1.5, 6.0


def draw_rays(why: Explanation) -> str:
    """Return an SVG of the rays, with the sensor's axis upwards, in the text colour of the page."""
    axis_deg = why.rays[len(why.rays) // 2].angle_deg
    most = max((abs(ray.contribution_counts) for ray in why.rays), default=0.0)
    reach_mm = _range_mm(why)
    parts = [_ring(share, reach_mm) for share in (1 / 3, 2 / 3, 1.0)]
    for number, ray in enumerate(why.rays, 1):
        share = abs(ray.contribution_counts) / most if most >= 0.5 else 0.0
        parts.append(_ray(number, ray, (ray.angle_deg - axis_deg + 180.0) % 360.0 - 180.0, reach_mm, share))
    parts.append('<rect x="-12" width="24" height="12" rx="2" fill="currentColor"/>')
    parts.append(_words(0, 26, f"sensor {why.sensor}", size=12))
    hits = ("nothing" if math.isinf(ray.length_mm) else f"{ray.met} at {ray.length_mm:.1f} mm" for ray in why.rays)
    label = escape(f"Rays of sensor {why.sensor}: {'; '.join(hits)}", quote=True)
    return (
        f'<svg viewBox="-180 -206 360 236" role="img" aria-label="{label}" '
        f'style="width: 100%; max-width: 460px; display: block; margin: 0 auto">{"".join(parts)}</svg>'
    )


def _range_mm(why: Explanation) -> float:
    """Return the range of the drawing: the sensor's reach, or less if all rays end nearer."""
    longest_mm = max(ray.length_mm for ray in why.rays)
    if math.isinf(longest_mm):
        return why.reach_mm
    return min((range_mm for range_mm in _RANGES_MM if range_mm >= longest_mm), default=why.reach_mm)


def _point(turn_deg: float, way: float) -> tuple[float, float]:
    """Return the point at the distance `way` along a ray; a positive turn is to the left."""
    turn = math.radians(turn_deg)
    return -way * math.sin(turn), -way * math.cos(turn)


def _ring(share: float, reach_mm: float) -> str:
    way = share * _REACH
    (x0, y0), (x1, y1) = _point(66.0, way), _point(-66.0, way)
    path = f"M{x0:.1f} {y0:.1f} A{way:.1f} {way:.1f} 0 0 1 {x1:.1f} {y1:.1f}"
    arc = f'<path d="{path}" fill="none" stroke="currentColor" opacity=".25"/>'
    return arc + _words(x1 + 4, y1 + 14, f"{share * reach_mm:.0f} mm", size=10, faint=True)


def _ray(number: int, ray: SeenRay, turn_deg: float, reach_mm: float, share: float) -> str:
    """Return a ray with what it hit: a bar for a wall, a ring for a robot, a disc for a ball or cylinder."""
    is_nothing = math.isinf(ray.length_mm)
    way = _REACH * (1.0 if is_nothing else min(ray.length_mm / reach_mm, 1.0))
    line = f'<line y2="{-way:.1f}" stroke='
    if is_nothing:
        drawn = line + '"currentColor" stroke-width="1" stroke-dasharray="3 4" opacity=".5"/>'
    else:
        what, _, met = ray.met.partition(" ")
        colour = css(robot_colour(int(met) - 1)) if what == "robot" else _COLOURS[what]
        drawn = line + f'"{colour}" stroke-width="{_THIN + share * (_THICK - _THIN):.1f}" stroke-linecap="round"/>'
        shape, fill = f'circle cy="{-way:.1f}" r="6"', "none" if what == "robot" else colour
        if what == "wall":
            shape, grey = f'rect x="-9" y="{-way - 6:.1f}" width="18" height="6"', ray.brightness
            fill = f"rgb({grey},{grey},{grey})"
        drawn += f'<{shape} fill="{fill}" stroke="{colour}" stroke-width="2"/>'
    x, y = _point(turn_deg, _REACH + 18.0)
    length = "–" if is_nothing else f"{ray.length_mm:.1f}"
    words = _words(x, y - 6, str(number), size=11, faint=True) + _words(x, y + 8, length, size=13)
    return f'<g transform="rotate({-turn_deg:.1f})">{drawn}</g>{words}'


def _words(x: float, y: float, text: str, *, size: int, faint: bool = False) -> str:
    opacity = ' opacity=".7"' if faint else ""
    return (
        f'<text x="{x:.1f}" y="{y:.1f}" text-anchor="middle" fill="currentColor" font-size="{size}"{opacity}>'
        f"{escape(text)}</text>"
    )
