#!/usr/bin/env python3
"""Makes demo.svg, the animation in the README, from the two pictures that a run of the demo saves.

    sketchnav demo --out out
    python3 docs/pictures/demo.py out/demo-001 docs/pictures/demo.svg

A viewer without animation shows the whole trajectory.
"""
import re
import sys
from pathlib import Path

SECONDS, STANDS = 24.0, 3.0  # duration of the loop, and of the still picture at its end
TASK_S = [16.8, 30.0, 28.4, 20.3, 37.2, 26.9, 24.4, 28.0, 27.7]  # from the demo's table, seed 1
WIDTH, SCALE = 1200, 0.5


def thinned(data):
    """Returns every third point of a trajectory, and both ends."""
    points = re.findall(r"[ML]([-\d.]+ [-\d.]+)", data)
    kept = points[:-1:3] + points[-1:]
    return "M" + "L".join(kept)


def panel(svg, at, title, dot):
    lines = svg.splitlines()
    frame = next(i for i, line in enumerate(lines) if line.startswith("<rect x="))
    body, ways = [lines[frame]], []
    for line in lines[frame + 1:]:
        if 'stroke-opacity="0.8"' in line:  # the white line beneath a trajectory
            continue
        way = re.match(r'<path d="(M[^"]*)".*stroke="(#\w+)" stroke-width="3"/>', line)
        if way and len(ways) < len(TASK_S):
            ways.append((thinned(way[1]), way[2]))
        elif line.startswith("<image"):
            body.append(line)
        elif line.startswith("<path") and not ways and "dasharray" not in line:
            body.append(line)
    total, clock = sum(TASK_S), 0.0
    drive = SECONDS - STANDS
    times = [0.0]
    for (data, colour), seconds in zip(ways, TASK_S):
        begin, end = clock / total * drive / SECONDS, (clock + seconds) / total * drive / SECONDS
        clock += seconds
        times.append(end)
        body.append(
            f'<path d="{data}" pathLength="1" fill="none" stroke="{colour}" stroke-width="4" stroke-linejoin="round" '
            f'stroke-dasharray="1 1"><animate attributeName="stroke-dashoffset" values="1;1;0;0" '
            f'keyTimes="0;{begin:.4f};{end:.4f};1" dur="{SECONDS}s" repeatCount="indefinite"/></path>')
    whole = ways[0][0] + "".join("L" + data[1:] for data, _ in ways[1:])
    lengths = [length(data) for data, _ in ways]
    shares = [sum(lengths[:i]) / sum(lengths) for i in range(len(ways) + 1)]
    assert len(shares) == len(times), (len(shares), len(times))
    points = ";".join(f"{share:.4f}" for share in [*shares, 1.0])
    keys = ";".join(f"{time:.4f}" for time in times + [1.0])
    body.append(
        f'<circle r="9" fill="{dot}" stroke="#ffffff" stroke-width="3"><animateMotion path="{whole}" calcMode="linear" '
        f'keyPoints="{points}" keyTimes="{keys}" dur="{SECONDS}s" repeatCount="indefinite"/></circle>')
    x, y = at
    heading = f'<text x="{x + 300}" y="{y + 20}" text-anchor="middle" font-size="17" fill="#20242c">{title}</text>'
    inner = "\n".join(body)
    return f'{heading}\n<g transform="translate({x} {y + 8}) scale({SCALE})">\n{inner}\n</g>'


def length(data):
    points = [tuple(map(float, point.split())) for point in re.findall(r"[ML]([-\d.]+ [-\d.]+)", data)]
    return sum(((a - c) ** 2 + (b - d) ** 2) ** 0.5 for (a, b), (c, d) in zip(points, points[1:]))


def main():
    run, output = Path(sys.argv[1]), Path(sys.argv[2])
    left = panel((run / "sketch.svg").read_text(), (0, 8), "the drawing: where the robot believes it is", "#20242c")
    right = panel((run / "floor.svg").read_text(), (600, 32), "the building: where the robot is", "#20242c")
    output.write_text(
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH} 336" width="{WIDTH}" height="336" '
        f'font-family="Helvetica, Arial, sans-serif">\n<rect width="100%" height="100%" fill="#f7f8fa"/>\n'
        f"{left}\n{right}\n</svg>\n")


main()
