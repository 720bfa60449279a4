#pragma once

#include "mirrorbake/scene/scene.hpp"

namespace mirrorbake {

/// Gives a mesh that has normals and coordinates the tangents that glTF 2.0 §3.7.2.1 asks for where a file
/// has none: at every vertex the mean of its triangles' directions of u, each in the plane of the vertex's
/// normal, weighted with the triangle's angle there, triangles whose texture is mirrored apart from the
/// others (Mikkelsen, Simulation of Wrinkled Surfaces Revisited, University of Copenhagen 2008; MikkTSpace).
/// Vertices of equal position, normal and coordinates count as one; one that both kinds of triangles share
/// becomes two. Unlike MikkTSpace, fans that only touch in a vertex are not told apart. Vertices that have a
/// tangent already keep it; where coordinates have no direction, there is none.
void derive_tangents(TriangleMesh& mesh);

}  // namespace mirrorbake
