#!/usr/bin/env python3
"""Writes fingertip.step and fingertip.stl: a cylinder of 16 mm that ends in half a ball, less a core of 8 mm of the same form.

The tip points along x, which begins at the held end. Needs Gmsh's Python package (pip install gmsh).
"""

import gmsh


def round_ended(radius):
    """A cylinder from x = 0 to 8 mm and the half ball on it."""
    cylinder = gmsh.model.occ.addCylinder(0, 0, 0, 8, 0, 0, radius)
    ball = gmsh.model.occ.addSphere(8, 0, 0, radius)
    return gmsh.model.occ.fuse([(3, cylinder)], [(3, ball)])[0]


gmsh.initialize()
gmsh.option.setNumber("General.Terminal", 0)
gmsh.model.occ.cut(round_ended(8), round_ended(4))
gmsh.model.occ.synchronize()
gmsh.write("fingertip.step")
gmsh.option.setNumber("Mesh.MeshSizeMax", 1.2)
gmsh.option.setNumber("Mesh.Binary", 1)
gmsh.model.mesh.generate(2)
gmsh.write("fingertip.stl")
