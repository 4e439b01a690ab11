// The work of one path is bounded, by the same count on every driver: a document may ask for a thousand bounces among
// thousands of transparent layers, and nothing can interrupt a dispatch. Each node of a tree that a path's rays come to
// and each shape that they are tested against is a turn; where there is no tree, each ray is one; so is, several times,
// each surface that they pass. A ray beyond the budget adds nothing and ends the path; the light that the path found
// before is right.
//
// llvmpipe of Mesa 22 ends all loops of an invocation after 65 535 turns, which eight lanes share, and loses the lanes
// that are still in one. With up to 28 672 turns in each lane the budget comes first, in closed meshes and through
// layers alike; 64 bounces in a closed room with a mesh of 70 000 triangles take up to 8 000.
const int BUDGET_TURNS = 28672;
const int BUDGET_LAYER = 6; // turns of a surface that is passed: more loops begin and end there

int budget_left = BUDGET_TURNS; // of the path, or of the search for the bodies around the camera

void budget_begin() { budget_left = BUDGET_TURNS; }

bool budget_lasts() { return budget_left > 0; }
