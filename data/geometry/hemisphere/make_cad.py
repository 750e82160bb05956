#!/usr/bin/env python3
"""Writes fingertip.step and fingertip.stl: the lower half of a ball of 16 mm less that of a ball of 8 mm.

Needs Gmsh's Python package (pip install gmsh).
"""

import math

import gmsh

gmsh.initialize()
gmsh.option.setNumber("General.Terminal", 0)
outer = gmsh.model.occ.addSphere(0, 0, 0, 8, angle1=-math.pi / 2, angle2=0)
inner = gmsh.model.occ.addSphere(0, 0, 0, 4, angle1=-math.pi / 2, angle2=0)
gmsh.model.occ.cut([(3, outer)], [(3, inner)])
gmsh.model.occ.synchronize()
gmsh.write("fingertip.step")
gmsh.option.setNumber("Mesh.MeshSizeMax", 0.8)
gmsh.option.setNumber("Mesh.Binary", 1)
gmsh.model.mesh.generate(2)
gmsh.write("fingertip.stl")
