// A cushion like the end of a finger: a hemisphere of hexahedra (bone, subcutaneous tissue, skin) that points down, and
// a plate of tetrahedra (nail) that lies on its flat top and shares no node with it.
// Written with Gmsh 4.8: gmsh -3 cushion.geo -format msh41 -o cushion.msh   (and -format inp -o cushion_gmsh.inp)
SetFactory("Built-in");
Mesh.Binary = 0;
Mesh.MshFileVersion = 4.1;
n = 6;            // elements along an edge of the core
m = 3;            // layers of subcutaneous tissue
core = 1.6;       // half edge of the bone, mm
inner = 5.4;      // radius of the skin's inner side, mm
outer = 6.0;      // radius of the skin's outer side, mm
flat = 0.70710678118654752;
third = 0.57735026918962576;

// Corners 0-3 at the top (z = 0), 4-7 at the bottom, on the core, the inner and the outer sphere.
Point(1000) = {0, 0, 0};
For s In {0:2}
  For c In {0:7}
    sx = (c % 4 == 0 || c % 4 == 3) ? -1 : 1;
    sy = (c % 4 < 2) ? -1 : 1;
    low = (c < 4) ? 0 : 1;
    If (s == 0)
      Point(10*s + c + 1) = {sx*core, sy*core, -low*core};
    Else
      r = (s == 1) ? inner : outer;
      d = (low == 0) ? flat : third;
      Point(10*s + c + 1) = {sx*r*d, sy*r*d, -low*r*third};
    EndIf
  EndFor
EndFor

// Edges: 0-3 around the top, 4-7 around the bottom, 8-11 down; straight on the core, arcs on the spheres.
For s In {0:2}
  For c In {0:3}
    a = 10*s + c + 1; b = 10*s + (c + 1) % 4 + 1;
    If (s == 0)
      Line(100*s + c + 1) = {a, b};
      Line(100*s + c + 5) = {a + 4, b + 4};
      Line(100*s + c + 9) = {a, a + 4};
    Else
      Circle(100*s + c + 1) = {a, 1000, b};
      Circle(100*s + c + 5) = {a + 4, 1000, b + 4};
      Circle(100*s + c + 9) = {a, 1000, a + 4};
    EndIf
  EndFor
EndFor
For s In {0:1}
  For c In {0:7}
    Line(300 + 10*s + c + 1) = {10*s + c + 1, 10*s + 10 + c + 1};
  EndFor
EndFor
For s In {0:2}
  Transfinite Curve {100*s + 1 : 100*s + 12} = n + 1;
EndFor
Transfinite Curve {301:308} = m + 1 Using Progression 1.2;
Transfinite Curve {311:318} = 2;

// Sides and bottom of each shell; the top of the core.
For s In {0:2}
  For c In {0:3}
    Curve Loop(100*s + c + 1) = {100*s + c + 1, 100*s + (c + 1) % 4 + 9, -(100*s + c + 5), -(100*s + c + 9)};
    If (s == 0)
      Surface(100*s + c + 1) = {100*s + c + 1};
    Else
      Surface(100*s + c + 1) = {100*s + c + 1} In Sphere {1000};
    EndIf
  EndFor
  Curve Loop(100*s + 5) = {100*s + 5, 100*s + 6, 100*s + 7, 100*s + 8};
  If (s == 0)
    Surface(100*s + 5) = {100*s + 5};
  Else
    Surface(100*s + 5) = {100*s + 5} In Sphere {1000};
  EndIf
EndFor
Curve Loop(6) = {1, 2, 3, 4};
Surface(6) = {6};
// Walls between shells: along the top (1-4), along the bottom (5-8), down the corners (9-12).
For s In {0:1}
  For c In {0:3}
    d = (c + 1) % 4;
    Curve Loop(400 + 20*s + c + 1) = {100*s + c + 1, 300 + 10*s + d + 1, -(100*s + 100 + c + 1), -(300 + 10*s + c + 1)};
    Curve Loop(400 + 20*s + c + 5) = {100*s + c + 5, 300 + 10*s + d + 5, -(100*s + 100 + c + 5), -(300 + 10*s + c + 5)};
    Curve Loop(400 + 20*s + c + 9) = {100*s + c + 9, 300 + 10*s + c + 5, -(100*s + 100 + c + 9), -(300 + 10*s + c + 1)};
    Surface(400 + 20*s + c + 1) = {400 + 20*s + c + 1};
    Surface(400 + 20*s + c + 5) = {400 + 20*s + c + 5};
    Surface(400 + 20*s + c + 9) = {400 + 20*s + c + 9};
  EndFor
EndFor
Transfinite Surface {:};
Recombine Surface {:};
Surface Loop(1) = {1, 2, 3, 4, 5, 6};
Volume(1) = {1};
For s In {0:1}
  For c In {0:3}
    d = (c + 1) % 4;
    Surface Loop(10 + 10*s + c + 1) = {100*s + c + 1, 100*s + 100 + c + 1, 400 + 20*s + c + 1, 400 + 20*s + c + 5, 400 + 20*s + c + 9, 400 + 20*s + d + 9};
    Volume(10 + 10*s + c + 1) = {10 + 10*s + c + 1};
  EndFor
  Surface Loop(10 + 10*s + 5) = {100*s + 5, 100*s + 105, 400 + 20*s + 5, 400 + 20*s + 6, 400 + 20*s + 7, 400 + 20*s + 8};
  Volume(10 + 10*s + 5) = {10 + 10*s + 5};
EndFor
Transfinite Volume {:};

// The nail: 1 mm thick, on the top of the tissue behind the core, of tetrahedra.
Point(2001) = {-2, 2.2, 0, 1.0};
Point(2002) = {2, 2.2, 0, 1.0};
Point(2003) = {2, 3.6, 0, 1.0};
Point(2004) = {-2, 3.6, 0, 1.0};
For c In {0:3}
  Line(2001 + c) = {2001 + c, 2001 + (c + 1) % 4};
EndFor
Curve Loop(2001) = {2001, 2002, 2003, 2004};
Plane Surface(2001) = {2001};
nail[] = Extrude {0, 0, 1.0} { Surface{2001}; };

Physical Volume("phalanx") = {1};
Physical Volume("pulp") = {11:15};
Physical Volume("epidermis") = {21:25};
Physical Volume("plate") = {nail[1]};
Physical Surface("pad") = {205};
Physical Surface("nail top") = {nail[0]};
Physical Surface("cut") = {6};
