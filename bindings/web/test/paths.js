// Paths of pictures and tests.

/** There and back and there again, with a twist on the way, held before all of it slips. */
export const PATH = `t_s,depth_mm,slide_x_mm,slide_y_mm,spin_deg
0,-0.2,0,0,0
1,1.2,0,0,0
1.3,1.2,0,0,0
3.2,1.2,3.9,0,0
6.4,1.2,-3.2,0,0
8.2,1.2,1.3,0.3,9
9,1.2,1.3,0.3,9`;
