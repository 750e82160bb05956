#!/usr/bin/env python3
"""Writes hexes.inp: the shell of fingertip.step in structured hexahedra, lowest point at the origin.

Five patches of a cubed sphere, the lower one whole and the four upper ones half, times layers from the core outward;
faces are smaller toward the lowest point, layers toward the surface.
"""

import math

OUTER_MM, CORE_MM = 8.0, 4.0
ACROSS, UP, LAYERS = 24, 7, 10
# Share of the cubic part of the spacing across the lower patch: 0 is even.
GRADING = 0.35

nodes, elements = {}, []


def node(direction, radius):
    length = math.sqrt(sum(c * c for c in direction))
    place = tuple(radius * c / length + shift for c, shift in zip(direction, (0.0, 0.0, OUTER_MM)))
    return nodes.setdefault(tuple(round(c, 9) + 0.0 for c in place), len(nodes) + 1)


def angle(n):
    t = 2.0 * n / ACROSS - 1.0
    return math.tan(math.pi / 4 * ((1.0 - GRADING) * t + GRADING * t**3))


def patch(direction, across, up):
    radii = [CORE_MM + (OUTER_MM - CORE_MM) * (1.3 * t - 0.3 * t * t) for t in (k / LAYERS for k in range(LAYERS + 1))]
    for i in range(across):
        for j in range(up):
            for k in range(LAYERS):
                square = [(i, j), (i + 1, j), (i + 1, j + 1), (i, j + 1)]
                elements.append([node(direction(u, v), radii[layer]) for layer in (k, k + 1) for u, v in square])


patch(lambda u, v: (angle(v), angle(u), -1.0), ACROSS, ACROSS)
# From the lower patch up to the equator, evenly.
rise = lambda v: math.tan(-math.pi / 4 * (1.0 - v / UP))
for x, y in [(1, 0), (0, 1), (-1, 0), (0, -1)]:
    patch(lambda u, v, x=x, y=y: (x - y * angle(u), y + x * angle(u), rise(v)), ACROSS, UP)

places = {number: place for place, number in nodes.items()}
distance = lambda p: math.dist(p, (0.0, 0.0, OUTER_MM))
sets = {
    "proximal_fix": [n for n, p in places.items() if p[2] > OUTER_MM - 1e-6],
    "bone": [n for n, p in places.items() if distance(p) < CORE_MM + 1e-6],
}
with open("hexes.inp", "w", encoding="utf-8") as file:
    file.write("*HEADING\nshell between half balls of 8 and 16 mm, mm; made by make_hexes.py\n*NODE\n")
    for number, place in places.items():
        file.write(", ".join([str(number)] + [f"{c:.7g}" for c in place]) + "\n")
    file.write("*ELEMENT, TYPE=C3D8, ELSET=skin\n")
    for number, element in enumerate(elements, 1):
        file.write(", ".join(map(str, [number, *element])) + "\n")
    for name, members in sets.items():
        file.write(f"*NSET, NSET={name}\n")
        for n in range(0, len(members), 12):
            file.write(", ".join(map(str, members[n:n + 12])) + ",\n")
print(len(nodes), "nodes,", len(elements), "hexahedra")
