#!/usr/bin/env python3
"""Meshes a soft finger out of CAD (STEP or STL) with 10-node tetrahedra that `fingerpad` reads.

Needs Gmsh's Python package: pip install gmsh (on a bare Debian also: apt-get install libglu1-mesa libxcursor1 libxft2
libxinerama1 libxrender1). Writes a binary .msh of version 4.1 and, beside it, a configuration with which
`fingerpad mesh --config` and `fingerpad simulate --config` use it.

    cad_to_mesh.py finger.step --list                     # surfaces and volumes with their numbers and places
    cad_to_mesh.py finger.step --size-mm 2 --pad-size-mm 0.8 --held 3 --core 2 --out finger.msh

The finger's pad looks along the file's -z, or along what --down says, its tip along +x; `fingerpad` inclines it, tip down, by
--incline-deg and finds where it first touches the plane.
Exit codes: 0 done, 2 bad usage or a file that cannot be meshed, with the place of what is wrong.
"""

import argparse
import math
import os
import struct
import sys
from collections import defaultdict

import gmsh


class Refused(Exception):
    """What is wrong with the file, in a sentence."""


def main():
    arguments = parsed()
    gmsh.initialize(interruptible=False)
    gmsh.option.setNumber("General.Terminal", 0)
    gmsh.model.add("cad")
    try:
        low = load(arguments)
        if arguments.list:
            print(listing())
            return 0
        name_groups(arguments)
        set_sizes(arguments, low)
        make_tetrahedra(arguments, low)
        place(arguments)
        write(arguments)
        return 0
    except Refused as refused:
        print(f"{arguments.file}: {refused}", file=sys.stderr)
        return 2
    finally:
        gmsh.finalize()


def parsed():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    numbers = lambda text: [int(number) for number in text.split(",")]
    parser.add_argument("file", help=".step, .stp or .stl; an STL bounds one volume and must be closed")
    parser.add_argument("--out", default="finger.msh", help="mesh to write (default: %(default)s)")
    parser.add_argument("--list", action="store_true", help="list surfaces and volumes, and mesh nothing")
    parser.add_argument("--size-mm", type=float, default=2.0, help="edge of elements far from the pad (default: %(default)s)")
    parser.add_argument("--pad-size-mm", type=float, default=1.0, help="edge of elements at the pad (default: %(default)s); "
                        "contact has a node at every half of it")
    parser.add_argument("--pad-radius-mm", type=float, default=4.0, help="how far about the lowest point elements are as "
                        "small as at the pad (default: %(default)s)")
    parser.add_argument("--pad-height-mm", type=float, default=3.0, help="faces up to this height over the lowest point may "
                        "touch (default: %(default)s)")
    parser.add_argument("--held", type=numbers, default=[], metavar="N,N", help="surfaces held fixed: the set proximal_fix")
    parser.add_argument("--core", type=numbers, default=[], metavar="N,N", help="surfaces bonded to a rigid core: the set bone")
    parser.add_argument("--subcutaneous", type=numbers, default=[], metavar="N,N", help="volumes of the inner soft material; "
                        "all others are skin, the outer one")
    parser.add_argument("--unit-mm", type=float, default=1.0, help="length of the file's unit (STEP files say it themselves)")
    parser.add_argument("--down", choices=["-x", "+x", "-y", "+y", "-z", "+z"], default="-z", help="where the pad looks in "
                        "the file (write --down=-x; default: -z)")
    parser.add_argument("--incline-deg", type=float, default=0.0, help="angle between finger and plane, 0 to 85: the tip, which "
                        "points along the file's +x (+y if the pad looks along x, +z if along y), is turned down by it "
                        "(default: %(default)s)")
    parser.add_argument("--flat", action="store_true", help="the pad is flat, and touches all at once: the middle of its lowest "
                        "nodes comes to the origin")
    parser.add_argument("--crease-deg", type=float, default=40.0, help="an STL's facets that meet at a greater angle belong to "
                        "different surfaces (default: %(default)s)")
    arguments = parser.parse_args()
    for name in ["size_mm", "pad_size_mm", "pad_radius_mm", "pad_height_mm", "unit_mm", "crease_deg"]:
        value = getattr(arguments, name)
        if not (value > 0 and math.isfinite(value)):
            parser.error(f"--{name.replace('_', '-')} {value}: must be a positive number")
    if not 0 <= arguments.incline_deg <= 85:
        parser.error(f"--incline-deg {arguments.incline_deg}: must be an angle of 0 to 85 degrees")
    if arguments.flat and arguments.incline_deg:
        parser.error("--flat: a flat pad cannot be inclined")
    return arguments


def load(arguments):
    """The geometry in mm; its lowest point, in the file's frame."""
    if not os.path.isfile(arguments.file):
        raise Refused("no such file")
    kind = os.path.splitext(arguments.file)[1].lower()
    if kind in (".step", ".stp"):
        gmsh.option.setString("Geometry.OCCTargetUnit", "MM")
        try:
            shapes = gmsh.model.occ.importShapes(arguments.file)
        except Exception as error:
            raise Refused(f"is no STEP file that Gmsh reads ({error})")
        if arguments.unit_mm != 1.0:
            gmsh.model.occ.dilate(shapes, 0, 0, 0, *[arguments.unit_mm] * 3)
        # Touching solids share their faces, so that their meshes fit.
        solids = [shape for shape in shapes if shape[0] == 3]
        if len(solids) > 1:
            gmsh.model.occ.fragment(solids, [])
        gmsh.model.occ.synchronize()
    elif kind == ".stl":
        check_closed(*facets(arguments.file))
        gmsh.merge(arguments.file)
        if arguments.unit_mm != 1.0:
            gmsh.model.mesh.affineTransform(scaled(arguments.unit_mm))
        # Gmsh's surfaces are made of these very nodes, which must stay.
        low = lowest(arguments)
        gmsh.model.mesh.classifySurfaces(math.radians(arguments.crease_deg), True, True, math.pi)
        gmsh.model.mesh.createGeometry()
        surfaces = [tag for _, tag in gmsh.model.getEntities(2)]
        gmsh.model.geo.addVolume([gmsh.model.geo.addSurfaceLoop(surfaces)])
        gmsh.model.geo.synchronize()
    else:
        raise Refused("the name of a file to be meshed ends in .step, .stp or .stl")
    check_size(arguments)
    if not gmsh.model.getEntities(3):
        raise Refused("holds no volume: export it as a solid, not as surfaces")
    if kind != ".stl":
        gmsh.option.setNumber("Mesh.MeshSizeMax", arguments.pad_size_mm)
        gmsh.model.mesh.generate(2)
        low = lowest(arguments)
        gmsh.model.mesh.clear()
    return low


def check_size(arguments):
    """Refuses a size that only another unit explains."""
    box = gmsh.model.getBoundingBox(-1, -1)
    longest = max(high - low for low, high in zip(box, box[3:]))
    for name, factor in [("metres", 1000.0), ("micrometres", 0.001)]:
        if not 0.3 <= longest <= 3000 and 2 <= longest * factor <= 300:
            raise Refused(f"is {longest:.3g} mm long, which no fingertip is; in {name}? Give --unit-mm {arguments.unit_mm * factor:g}")


def scaled(factor):
    return [factor, 0, 0, 0, 0, factor, 0, 0, 0, 0, factor, 0, 0, 0, 0, 1]


def facets(path):
    """Corners of an STL's facets and, for a message, where each stands in the file."""
    with open(path, "rb") as file:
        data = file.read()
    count = struct.unpack("<I", data[80:84])[0] if len(data) >= 84 else 0
    if len(data) == 84 + 50 * count and count > 0:
        values = [struct.unpack("<12f", data[84 + 50 * n:132 + 50 * n]) for n in range(count)]
        return [[v[3:6], v[6:9], v[9:12]] for v in values], [f"facet {n + 1}" for n in range(count)]
    if not data.lstrip().startswith(b"solid"):
        raise Refused(f"is no STL: neither text nor {count} facets of 50 bytes in {len(data)} bytes")
    corners, triangles, places = [], [], []
    for number, line in enumerate(data.decode("utf-8", "replace").splitlines(), 1):
        words = line.split()
        if words[:1] == ["vertex"]:
            try:
                corners.append(tuple(float(word) for word in words[1:4]))
            except ValueError:
                raise Refused(f"line {number}: `{line.strip()}` is no vertex")
        elif words[:1] == ["endfacet"]:
            if len(corners) != 3:
                raise Refused(f"line {number}: a facet of {len(corners)} corners, not 3")
            triangles.append(corners)
            places.append(f"facet {len(triangles)} before line {number}")
            corners = []
    if not triangles:
        raise Refused("holds no facet")
    return triangles, places


def check_closed(triangles, places):
    """Refuses holes and edges of more than two facets, with their place."""
    points = [corner for triangle in triangles for corner in triangle]
    if not all(math.isfinite(c) for point in points for c in point):
        raise Refused("a corner is not at a finite place")
    extent = max(max(p[k] for p in points) - min(p[k] for p in points) for k in range(3))
    grain = 1e-6 * extent
    number = {}
    index = lambda p: number.setdefault(tuple(round(c / grain) for c in p), len(number))
    place_of = {}
    edges = defaultdict(list)
    for triangle, place in zip(triangles, places):
        corners = [index(p) for p in triangle]
        place_of.update(zip(corners, triangle))
        if len(set(corners)) == 3:
            for a, b in zip(corners, corners[1:] + corners[:1]):
                edges[min(a, b), max(a, b)].append(place)
    spot = lambda p: "({:.4g}, {:.4g}, {:.4g})".format(*p)
    open_edges = {edge: uses for edge, uses in edges.items() if len(uses) == 1}
    if open_edges:
        rings = []
        for edge in open_edges:
            touching = [ring for ring in rings if not ring.isdisjoint(edge)]
            rings = [ring for ring in rings if ring not in touching] + [set(edge).union(*touching)]
        holes = []
        for ring in sorted(rings, key=len, reverse=True)[:5]:
            middle = [sum(place_of[n][k] for n in ring) / len(ring) for k in range(3)]
            beside = next(uses[0] for edge, uses in open_edges.items() if edge[0] in ring)
            holes.append(f"around {spot(middle)} with {len(ring)} corners, beside {beside}")
        raise Refused(f"has {len(rings)} hole(s): " + "; ".join(holes))
    for (a, b), uses in edges.items():
        if len(uses) > 2:
            between = f"the edge from {spot(place_of[a])} to {spot(place_of[b])}"
            raise Refused(f"{between} belongs to {len(uses)} facets, among them {uses[2]}")


def listing():
    lines = []
    for dimension, what, unit in [(3, "volume", "mm3"), (2, "surface", "mm2")]:
        for _, tag in gmsh.model.getEntities(dimension):
            x0, y0, z0, x1, y1, z1 = gmsh.model.getBoundingBox(dimension, tag)
            kind = gmsh.model.getType(dimension, tag)
            lines.append(f"{what} {tag} ({kind}): x {x0:.2f} to {x1:.2f}, y {y0:.2f} to {y1:.2f}, z {z0:.2f} to {z1:.2f} mm")
    return "\n".join(lines)


def name_groups(arguments):
    volumes = [tag for _, tag in gmsh.model.getEntities(3)]
    surfaces = [tag for _, tag in gmsh.model.getEntities(2)]
    for option, given, known in [("--held", arguments.held, surfaces), ("--core", arguments.core, surfaces),
                                 ("--subcutaneous", arguments.subcutaneous, volumes)]:
        for tag in given:
            if tag not in known:
                raise Refused(f"{option} {tag}: there is no such number; there is\n{listing()}")
    if not arguments.held:
        raise Refused(f"nothing holds the finger: give --held the numbers of its surfaces among\n{listing()}")
    skin = [tag for tag in volumes if tag not in arguments.subcutaneous]
    groups = [(3, skin, "skin"), (3, arguments.subcutaneous, "subcutaneous"), (2, arguments.held, "proximal_fix"),
              (2, arguments.core, "bone")]
    for dimension, tags, name in groups:
        if tags:
            gmsh.model.addPhysicalGroup(dimension, tags, name=name)


def to_finger(arguments):
    """Rows of the rotation that turns --down to -z."""
    sign = 1.0 if arguments.down[0] == "-" else -1.0
    axis = "xyz".index(arguments.down[1])
    up = [sign * (k == axis) for k in range(3)]
    along = [float(k == (axis + 1) % 3) for k in range(3)]
    left = [up[(k + 1) % 3] * along[(k + 2) % 3] - up[(k + 2) % 3] * along[(k + 1) % 3] for k in range(3)]
    return [along, left, up]


def lowest(arguments):
    """The node that lies lowest, in the file's frame, mm."""
    along, _, up = to_finger(arguments)
    angle = math.radians(arguments.incline_deg)
    up = [math.cos(angle) * z - math.sin(angle) * x for x, z in zip(along, up)]
    _, places, _ = gmsh.model.mesh.getNodes()
    nodes = [places[n:n + 3] for n in range(0, len(places), 3)]
    return min(nodes, key=lambda p: sum(u * c for u, c in zip(up, p)))


def set_sizes(arguments, low):
    field = gmsh.model.mesh.field
    ball = field.add("Ball")
    for k, name in enumerate(["XCenter", "YCenter", "ZCenter"]):
        field.setNumber(ball, name, low[k])
    field.setNumber(ball, "Radius", arguments.pad_radius_mm)
    # From the pad's size to the other over a way on which an element grows by a third of its size.
    field.setNumber(ball, "Thickness", max(3.0 * (arguments.size_mm - arguments.pad_size_mm), 1e-6))
    field.setNumber(ball, "VIn", arguments.pad_size_mm)
    field.setNumber(ball, "VOut", arguments.size_mm)
    field.setAsBackgroundMesh(ball)
    for name, value in [("MeshSizeMax", arguments.size_mm), ("MeshSizeExtendFromBoundary", 0), ("MeshSizeFromPoints", 0),
                        ("MeshSizeFromCurvature", 0), ("Optimize", 1), ("HighOrderOptimize", 0), ("RandomSeed", 1)]:
        gmsh.option.setNumber(f"Mesh.{name}", value)


def make_tetrahedra(arguments, low):
    """Tetrahedra of second order; where the geometry makes slivers, on surfaces without its short edges."""
    tags, nodes, places, straight = filled()
    worst, spot = least_quality(nodes, places)
    cad, removed = gmsh.model.getCurrent(), 0.0
    boundary = {tag: [face for _, face in gmsh.model.getBoundary([(3, tag)], oriented=False)]
                for _, tag in gmsh.model.getEntities(3)}
    surfaces = surface_mesh()
    for share in SHARES:
        if worst >= ENOUGH:
            break
        surfaces = without_slivers(*surfaces, share * arguments.pad_size_mm)
        try:
            use_surfaces(arguments, low, f"{cad}, {share}", boundary, *surfaces)
            found = filled(cad)
            quality, where = least_quality(found[1], found[2])
        except Refused:
            continue
        if quality > worst:
            (tags, nodes, places, straight), worst, spot = found, quality, where
            kept, removed = gmsh.model.getCurrent(), share * arguments.pad_size_mm
    if not worst >= LEAST:
        raise Refused("a tetrahedron at ({:.4g}, {:.4g}, {:.4g}) mm is inverted or flat (scaled Jacobian {:.1e}): mend the "
                      "geometry there, or change the sizes".format(*spot, worst))
    if removed:
        gmsh.model.setCurrent(kept)
        print(f"details smaller than {removed:.3g} mm, of which slivers would be made, were left out")
    print(f"{len(tags)} tetrahedra, {straight} of them with straightened edges, least scaled Jacobian {worst:.3f}")
    if worst < GOOD:
        print("below {} at ({:.4g}, {:.4g}, {:.4g}) mm in the file: runs may be slow; smaller sizes or a geometry without "
              "thin details there help".format(GOOD, *spot))


def filled(cad=None):
    """Fills the surfaces with tetrahedra: numbers, nodes of each, places of the nodes, number of straightened ones."""
    try:
        gmsh.model.mesh.generate(3)
        gmsh.model.mesh.optimize("Netgen")
        gmsh.model.mesh.setOrder(2)
    except Exception as error:
        raise Refused(f"Gmsh could not mesh it ({error}): mend the geometry, or change the sizes")
    tags, nodes = gmsh.model.mesh.getElementsByType(11)
    if len(tags) == 0:
        raise Refused("Gmsh made no tetrahedra: is it a closed solid?")
    nodes = [[int(n) for n in nodes[n:n + 10]] for n in range(0, len(nodes), 10)]
    numbers, values, _ = gmsh.model.mesh.getNodes()
    places = {int(n): tuple(values[3 * k:3 * k + 3]) for k, n in enumerate(numbers)}
    moved = onto_surfaces(cad, places) if cad else set()
    straight = straighten(nodes, places, moved)
    for node in moved:
        gmsh.model.mesh.setNode(node, places[node], [])
    return tags, nodes, places, straight


# Corners of the twelve linear parts of a 10-node tetrahedron in Gmsh's order; 10 is the mean of the edge nodes.
PARTS = [(0, 4, 6, 7), (4, 1, 5, 9), (6, 5, 2, 8), (7, 9, 8, 3), (4, 5, 6, 10), (8, 6, 5, 10), (4, 6, 7, 10), (4, 9, 5, 10),
         (8, 7, 6, 10), (8, 5, 9, 10), (4, 7, 9, 10), (8, 9, 7, 10)]
EDGES = [(0, 1), (1, 2), (2, 0), (0, 3), (2, 3), (1, 3)]
# Scaled Jacobian of a good mesh, one for which no detail is left out, and the least with which anything can be computed.
GOOD, ENOUGH, LEAST = 0.1, 0.05, 1e-3
# Details that are left out where they make slivers, shares of the pad's size.
SHARES = [0.01, 0.03, 0.1]


def volume(a, b, c, d):
    (ux, uy, uz), (vx, vy, vz), (wx, wy, wz) = ([q - p for p, q in zip(a, other)] for other in (b, c, d))
    return (ux * (vy * wz - vz * wy) + uy * (vz * wx - vx * wz) + uz * (vx * wy - vy * wx)) / 6


def shape_and_squeeze(p):
    """The scaled Jacobian of the corners, and the least volume of a part over that with straight edges: `fingerpad mesh` refuses and
    prints their product."""
    whole = volume(*p[:4])
    greatest = max(math.prod(math.dist(p[i], p[k]) for k in range(4) if k != i) for i in range(4))
    shape = math.sqrt(2) * 6 * whole / greatest if greatest > 0 else 0.0
    if not whole > 0:
        return -abs(shape), 1.0
    p = [*p, [sum(c) / 6 for c in zip(*p[4:])]]
    squeeze = min(volume(*(p[k] for k in part)) / whole * (8 if n < 4 else 16) for n, part in enumerate(PARTS))
    return shape, min(1.0, squeeze)


def least_quality(nodes, places):
    """Least scaled Jacobian of the tetrahedra, and the place of that one."""
    def quality(tetrahedron):
        shape, squeeze = shape_and_squeeze([places[n] for n in tetrahedron])
        return shape * squeeze
    worst = min(nodes, key=quality)
    return quality(worst), places[worst[0]]


def straighten(nodes, places, moved):
    """Puts the edge nodes of elements that the curved surface squeezes to the middles of their edges; how many."""
    squeezed = set()
    # Straightening one may squeeze its neighbour.
    for _ in range(20):
        of_all = [shape_and_squeeze([places[k] for k in tetrahedron]) for tetrahedron in nodes]
        is_squeezed = lambda shape, squeeze: squeeze < 0.15 or squeeze < 0.99 and shape * squeeze < GOOD
        more = [n for n, found in enumerate(of_all) if n not in squeezed and is_squeezed(*found)]
        if not more:
            break
        squeezed.update(more)
        for n in more:
            for edge, (a, b) in enumerate(EDGES):
                node = nodes[n][4 + edge]
                places[node] = tuple((p + q) / 2 for p, q in zip(places[nodes[n][a]], places[nodes[n][b]]))
                moved.add(node)
    return len(squeezed)


def onto_surfaces(cad, places):
    """Puts the edge nodes of faces of a mesh without geometry on the surfaces of the CAD model; which."""
    repaired, of_surface = gmsh.model.getCurrent(), {}
    for _, surface in gmsh.model.getEntities(2):
        _, nodes = gmsh.model.mesh.getElementsByType(9, surface)
        faces = [[int(n) for n in nodes[n:n + 6]] for n in range(0, len(nodes), 6)]
        of_surface[surface] = {face[3 + k]: (face[k], face[(k + 1) % 3]) for face in faces for k in range(3)}
    moved = set()
    gmsh.model.setCurrent(cad)
    # A node between two surfaces comes to both after few turns.
    for surface, edges in [*of_surface.items()] * 3:
        try:
            flat = [c for node in edges for c in places[node]]
            found, _ = gmsh.model.getClosestPoint(2, surface, flat)
        except Exception:
            continue
        for k, (node, (a, b)) in enumerate(edges.items()):
            place = tuple(found[3 * k:3 * k + 3])
            if 1e-9 < math.dist(place, places[node]) < 0.2 * math.dist(places[a], places[b]):
                places[node] = place
                moved.add(node)
    gmsh.model.setCurrent(repaired)
    return moved


def surface_mesh():
    """Places of the corners of the surface mesh, the dimension of what each lies on, and the triangles with their surface."""
    places, on, triangles = {}, {}, []
    for dimension, entity in gmsh.model.getEntities():
        tags, values, _ = gmsh.model.mesh.getNodes(dimension, entity)
        for k, tag in enumerate(tags):
            places[int(tag)], on[int(tag)] = tuple(values[3 * k:3 * k + 3]), dimension
    for _, surface in gmsh.model.getEntities(2):
        _, nodes = gmsh.model.mesh.getElementsByType(9, surface)
        triangles += [(*(int(n) for n in nodes[n:n + 3]), surface) for n in range(0, len(nodes), 6)]
    return places, on, triangles


def without_slivers(places, on, triangles, least):
    """The same without edges and heights below `least` mm: the ends of a short edge become one node; a flat triangle gives way to
    its neighbours beyond its longest edge, which is split at its tip."""
    live, around = dict(enumerate(triangles)), defaultdict(set)
    fresh = iter(range(len(triangles), 100 * len(triangles) + 100))
    for number, triangle in live.items():
        for node in triangle[:3]:
            around[node].add(number)

    def add(triangle):
        number = next(fresh)
        live[number] = triangle
        for node in triangle[:3]:
            around[node].add(number)
        return number

    def remove(number):
        for node in live[number][:3]:
            around[node].discard(number)
        return live.pop(number)

    normal = lambda a, b, c: [(b[k - 2] - a[k - 2]) * (c[k - 1] - a[k - 1]) - (b[k - 1] - a[k - 1]) * (c[k - 2] - a[k - 2])
                              for k in range(3)]
    corners = lambda triangle: [places[n] for n in triangle[:3]]
    neighbours = lambda node: {n for t in around[node] for n in live[t][:3]} - {node}

    def height(triangle):
        a, b, c = corners(triangle)
        return math.hypot(*normal(a, b, c)) / max(math.dist(a, b), math.dist(b, c), math.dist(c, a), 1e-300)

    def merged(kept, gone):
        """The triangles after `gone` became `kept`, if that keeps the surface whole and turns none over."""
        shared = around[kept] & around[gone]
        tips = {n for t in shared for n in live[t][:3]} - {kept, gone}
        if on[kept] > on[gone] or neighbours(kept) & neighbours(gone) != tips:
            return None
        changed = [live[t] for t in around[gone] - shared]
        after = [tuple(kept if n == gone else n for n in t[:3]) + t[3:] for t in changed]
        turns = lambda old, new: sum(p * q for p, q in zip(normal(*corners(old)), normal(*corners(new)))) <= 0
        if any(height(old) > least and turns(old, new) for old, new in zip(changed, after)):
            return None
        for number in list(around[gone]):
            remove(number)
        return [add(triangle) for triangle in after]

    def split(number):
        """The triangles after a flat one gave way to those beyond its longest edge."""
        triangle = live[number]
        sides = [(triangle[k], triangle[(k + 1) % 3], triangle[(k + 2) % 3]) for k in range(3)]
        a, b, tip = max(sides, key=lambda side: math.dist(places[side[0]], places[side[1]]))
        others = (around[a] & around[b]) - {number}
        after = []
        for other in others:
            beyond = next(n for n in live[other][:3] if n not in (a, b))
            if beyond in neighbours(tip):
                return None
            after += [tuple(tip if n == end else n for n in live[other][:3]) + live[other][3:] for end in (a, b)]
        if not after or min(map(height, after)) <= height(triangle):
            return None
        for gone in [number, *others]:
            remove(gone)
        return [add(triangle) for triangle in after]

    queue = list(live)
    for _ in range(10):
        changed = False
        while queue:
            number = queue.pop()
            if number not in live or height(live[number]) >= least:
                continue
            a, b, c, _ = live[number]
            a, b = min([(a, b), (b, c), (c, a)], key=lambda edge: math.dist(places[edge[0]], places[edge[1]]))
            made = None
            if math.dist(places[a], places[b]) < least:
                made = merged(a, b)
                made = merged(b, a) if made is None else made
            if made is None:
                made = split(number)
            if made is not None:
                changed = True
                queue += made
        if not changed:
            break
        queue = list(live)
    return places, on, list(live.values())


def use_surfaces(arguments, low, name, boundary, places, _, triangles):
    """A model without geometry that is bounded by these triangles, with the groups and sizes of the one of CAD."""
    by_surface = defaultdict(list)
    for *corners, surface in triangles:
        by_surface[surface] += corners
    gmsh.model.add(name)
    for surface in by_surface:
        gmsh.model.addDiscreteEntity(2, surface)
    used = sorted({n for nodes in by_surface.values() for n in nodes})
    gmsh.model.mesh.addNodes(2, next(iter(by_surface)), used, [c for n in used for c in places[n]])
    for surface, nodes in by_surface.items():
        gmsh.model.mesh.addElementsByType(surface, 2, [], nodes)
    gmsh.model.mesh.reclassifyNodes()
    for tag, faces in boundary.items():
        loop = gmsh.model.geo.addSurfaceLoop([face for face in faces if face in by_surface])
        gmsh.model.geo.addVolume([loop], tag)
    gmsh.model.geo.synchronize()
    name_groups(arguments)
    set_sizes(arguments, low)


def place(arguments):
    rows = to_finger(arguments)
    inside = lambda p: [sum(u * c for u, c in zip(row, p)) for row in rows]
    shifts = [0.0, 0.0, 0.0]
    if arguments.flat:
        _, places, _ = gmsh.model.mesh.getNodes()
        nodes = [inside(places[n:n + 3]) for n in range(0, len(places), 3)]
        low = min(p[2] for p in nodes)
        flat = [p for p in nodes if p[2] < low + 1e-3 * arguments.pad_size_mm]
        shifts = [-sum(p[k] for p in flat) / len(flat) for k in range(2)] + [-low]
    matrix = [value for row, shift in zip(rows, shifts) for value in (*row, shift)] + [0, 0, 0, 1]
    gmsh.model.mesh.affineTransform(matrix)


def write(arguments):
    gmsh.option.setNumber("Mesh.MshFileVersion", 4.1)
    gmsh.option.setNumber("Mesh.Binary", 1)
    gmsh.write(arguments.out)
    configuration = os.path.splitext(arguments.out)[0] + ".toml"
    core = "" if not arguments.core else "\n[tissue.bone]\nkind = \"fixed\"\n"
    frame = 'frame = "plane"' if arguments.flat else f'frame = "finger"\ninclination_deg = {arguments.incline_deg}'
    with open(configuration, "w", encoding="utf-8") as file:
        file.write(f"""# A finger that tools/cad_to_mesh.py made of {os.path.basename(arguments.file)}.
[imported]
file = "{os.path.basename(arguments.out)}"
{frame}
pad_height_mm = {arguments.pad_height_mm}
{core}""")
    print(f"{arguments.out}, {configuration}")


if __name__ == "__main__":
    sys.exit(main())
