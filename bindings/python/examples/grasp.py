"""How well two or three fingers hold an object: the grasp wrench space of their limit surfaces, and its largest ball.

    fingerpad export --format limit-surface --out limit.csv
    python grasp.py limit.csv --fingers 3 --radius-mm 20

The fingers press a sphere or an upright disc around its equator, evenly spaced. A contact can exert the wrenches of its limit surface:
normal force, friction along two directions, and a moment about the normal. The grasp wrench space is the convex hull of those of all
contacts, each for 1 N of normal force; the fingers share 1 N. Torques are divided by the radius, so that all six components are forces.
The radius of the largest ball about zero is the least wrench, in N for each N of grip, that some direction of load can break the
grasp with: the quality epsilon of Ferrari and Canny (Planning optimal grasps, ICRA 1992). It is 0 where the grasp cannot resist some wrench.

`grasp.py --check` compares it with grasps whose quality is known in closed form. Needs numpy and scipy.
"""

import argparse
import sys

import numpy as np
from scipy.spatial import ConvexHull

COLUMNS = ["friction_x_n", "friction_y_n", "spin_moment_n_mm", "normal_force_n"]
# The directions in the file refine one another: the first 12, 42 and 162 of the 642 cover the sphere evenly as well.
DIRECTIONS = 162


def limit_surface(path, directions=DIRECTIONS):
    """Friction along x and y (N) and moment (N mm) for each N of normal force, shape (directions, 3)."""
    table = np.genfromtxt(path, delimiter=",", names=True)
    missing = [name for name in COLUMNS if name not in (table.dtype.names or ())]
    if missing:
        raise ValueError(f"{path}: no column {', '.join(missing)}; `fingerpad export --format limit-surface` writes them")
    if not 12 <= directions <= len(table):
        raise ValueError(f"{directions} directions; the allowed range is 12 to {len(table)}")
    x, y, moment, normal = (table[name][:directions] for name in COLUMNS)
    return np.column_stack([x, y, moment]) / normal[:, None]


def contact_wrenches(surface, place_mm, outward, finger_axis, length_mm):
    """Wrenches on the object by one contact with 1 N of normal force, shape (n, 6): force, and torque over a length.

    The finger's z axis is the object's outward normal, its x axis points along `finger_axis`. Forces in a limit surface are those on the
    finger; the object has the opposite ones.
    """
    y_axis = np.cross(outward, finger_axis)
    force = -(surface[:, :1] * finger_axis + surface[:, 1:2] * y_axis + outward)
    torque = np.cross(place_mm, force) - surface[:, 2:] * outward
    return np.hstack([force, torque / length_mm])


def grasp_wrenches(surface, fingers, radius_mm):
    """Wrenches of fingers around the equator of a sphere, their x axes upright."""
    upright = np.array([0.0, 0.0, 1.0])
    wrenches = []
    for angle in 2.0 * np.pi * np.arange(fingers) / fingers:
        outward = np.array([np.cos(angle), np.sin(angle), 0.0])
        wrenches.append(contact_wrenches(surface, radius_mm * outward, outward, upright, radius_mm))
    return np.vstack(wrenches)


def largest_ball(wrenches):
    """Radius of the largest ball about zero inside the convex hull, and the wrench direction that breaks the grasp first.

    The radius is 0 if zero lies outside or on the hull, or if the wrenches do not span the space.
    """
    dimension = wrenches.shape[1]
    values, directions = np.linalg.eigh(np.cov(wrenches.T))
    if values[0] < 1e-12 * values[-1]:
        return 0.0, directions[:, 0]
    # The wrenches of a contact lie in one hyperplane; Qhull moves them by less than 1e-8 of their size ("QJ") to keep facets simple.
    facets = ConvexHull(wrenches, qhull_options="QJ").equations
    nearest = facets[np.argmax(facets[:, dimension])]
    weakest = nearest[:dimension]
    # The same from the wrenches themselves: none reaches farther in the weakest direction.
    reach = np.max(wrenches @ weakest)
    if abs(reach + nearest[dimension]) > 1e-6 * np.abs(wrenches).max():
        raise ArithmeticError(f"the hull's nearest facet is {-nearest[dimension]} from zero, the wrenches reach to {reach}")
    return max(0.0, reach), weakest


def check():
    """Grasps whose quality is known in closed form."""
    # Two opposite point contacts with Coulomb friction in a plane: the hull is a tetrahedron, all of whose faces are mu / sqrt(2 + mu²)
    # away from zero.
    for mu in (0.2, 0.5, 1.0, 2.0):
        radius_mm = 20.0
        wrenches = []
        for side in (1.0, -1.0):
            for tangent in (mu, -mu):
                wrenches.append([-side, tangent, side * radius_mm * tangent / radius_mm])
        exact = mu / np.sqrt(2.0 + mu * mu)
        found, _ = largest_ball(np.array(wrenches))
        assert abs(found - exact) < 1e-9, (mu, found, exact)
        print(f"two point contacts in a plane, mu {mu}: {found:.6f}, exact {exact:.6f}")
    # Without a moment two contacts cannot resist a torque about the line between them.
    ring = np.array([[0.5 * np.cos(a), 0.5 * np.sin(a), 0.0] for a in np.linspace(0.0, 2.0 * np.pi, 40, endpoint=False)])
    found, weakest = largest_ball(grasp_wrenches(ring, 2, 20.0))
    assert found == 0.0 and abs(abs(weakest[3]) - 1.0) < 1e-9, (found, weakest)
    print(f"two point contacts in space: {found}, the free torque is about the line between them")
    # Two soft contacts whose limit surface is an ellipsoid with the semi-axes mu, mu and c: the smaller of c over the radius and
    # mu / sqrt(2 + mu²). Finitely many directions lie inside.
    for mu, c_mm in ((0.5, 2.0), (0.5, 12.0), (1.2, 6.0)):
        surface = spiral(150) * [mu, mu, c_mm]
        exact = min(c_mm / 20.0, mu / np.sqrt(2.0 + mu * mu))
        found, _ = largest_ball(grasp_wrenches(surface, 2, 20.0))
        assert 0.93 * exact < found <= exact * (1.0 + 1e-9), (mu, c_mm, found, exact)
        print(f"two soft contacts, mu {mu}, c {c_mm} mm: {found:.4f}, exact {exact:.4f}")


def spiral(count):
    """Points on the unit sphere along a spiral, evenly spread, the poles among them."""
    height = np.linspace(-1.0, 1.0, count)
    angle = np.pi * (1.0 + np.sqrt(5.0)) * np.arange(count)
    ring = np.sqrt(1.0 - height * height)
    return np.column_stack([ring * np.cos(angle), ring * np.sin(angle), height])


def main():
    parser = argparse.ArgumentParser(description="Quality of a grasp by two or three fingers (Ferrari and Canny 1992)")
    parser.add_argument("surface", nargs="?", help="limit surface: the CSV of `fingerpad export --format limit-surface`")
    parser.add_argument("--fingers", type=int, default=2, choices=(2, 3))
    parser.add_argument("--radius-mm", type=float, default=20.0, help="radius of the object; default 20")
    parser.add_argument("--directions", type=int, default=DIRECTIONS, help="points of the surface to use; default %(default)s")
    parser.add_argument("--check", action="store_true", help="compare with grasps whose quality is known, and end")
    arguments = parser.parse_args()
    if arguments.check:
        check()
        return
    if arguments.surface is None:
        parser.error("the limit surface is missing")
    if not 0.0 < arguments.radius_mm < float("inf"):
        parser.error(f"--radius-mm {arguments.radius_mm}: must be finite and above 0")
    try:
        surface = limit_surface(arguments.surface, arguments.directions)
    except (OSError, ValueError) as error:
        sys.exit(f"{error}")
    radius, weakest = largest_ball(grasp_wrenches(surface, arguments.fingers, arguments.radius_mm))
    print(f"{arguments.fingers} fingers on a radius of {arguments.radius_mm:g} mm: epsilon {radius:.4f} N for each N of grip")
    print("weakest against force", np.round(weakest[:3], 2), "and torque over the radius", np.round(weakest[3:], 2))


if __name__ == "__main__":
    main()
