"""Convex meshes of exact bodies, as MuJoCo's `<mesh>` elements. Metres."""

import numpy as np


def element(name, vertices, faces):
    """The element of a mesh in `<asset>`. ``vertices``: n x 3; ``faces``: k x 3, counter-clockwise seen from outside."""
    numbers = " ".join(f"{x:.9g}" for x in np.ravel(vertices))
    return f'<mesh name="{name}" vertex="{numbers}" face="{" ".join(map(str, np.ravel(faces)))}"/>'


def sphere(radius, rings=48):
    """Vertices on a sphere, on circles of latitude, and faces."""
    vertices = [[0.0, 0.0, radius]]
    for polar in np.pi * np.arange(1, rings) / rings:
        for turn in np.pi * np.arange(2 * rings) / rings:
            vertices.append([radius * np.sin(polar) * np.cos(turn), radius * np.sin(polar) * np.sin(turn), radius * np.cos(polar)])
    vertices.append([0.0, 0.0, -radius])
    round_ = 2 * rings
    at = lambda ring, k: 1 + ring * round_ + k % round_
    faces = [[0, at(0, k), at(0, k + 1)] for k in range(round_)]
    for ring in range(rings - 2):
        for k in range(round_):
            faces += [[at(ring, k), at(ring + 1, k), at(ring + 1, k + 1)], [at(ring, k), at(ring + 1, k + 1), at(ring, k + 1)]]
    last = len(vertices) - 1
    faces += [[last, at(rings - 2, k + 1), at(rings - 2, k)] for k in range(round_)]
    return np.array(vertices), np.array(faces)


def ellipsoid(semi_axes, rings=48):
    """A sphere that is stretched to these semi-axes."""
    vertices, faces = sphere(1.0, rings)
    return vertices * semi_axes, faces


def cylinder(radius, half, sides=128, rows=1):
    """A prism of ``sides`` sides about z with vertices on a cylinder."""
    turn = 2 * np.pi * np.arange(sides) / sides
    heights = np.linspace(-half, half, rows + 1)
    rim = lambda z: np.column_stack([radius * np.cos(turn), radius * np.sin(turn), np.full(sides, z)])
    vertices = np.vstack([*map(rim, heights), [[0.0, 0.0, -half], [0.0, 0.0, half]]])
    below, above = len(vertices) - 2, len(vertices) - 1
    faces = []
    for k in range(sides):
        right = (k + 1) % sides
        for row in range(rows):
            a, b = row * sides + k, row * sides + right
            faces += [[a, b, b + sides], [a, b + sides, a + sides]]
        faces += [[below, right, k], [above, rows * sides + k, rows * sides + right]]
    return vertices, np.array(faces)


def box(half, parts=8):
    """A box of these half sizes, each face divided into ``parts`` times ``parts`` squares of two facets."""
    vertices, faces = [], []
    for axis in range(3):
        for side in (1, -1):
            first = len(vertices)
            u, v = (axis + 1) % 3, (axis + 2) % 3
            for i in range(parts + 1):
                for j in range(parts + 1):
                    corner = np.empty(3)
                    corner[axis], corner[u], corner[v] = side, 2 * i / parts - 1, 2 * j / parts - 1
                    vertices.append(corner * half)
            for i in range(parts):
                for j in range(parts):
                    a = first + i * (parts + 1) + j
                    b, c, d = a + parts + 1, a + parts + 2, a + 1
                    faces += [[a, b, c], [a, c, d]] if side == 1 else [[a, c, b], [a, d, c]]
    return np.array(vertices), np.array(faces)
