#pragma once

#include <functional>
#include <string>

#include <tiny_gltf.h>

#include <glm/mat4x4.hpp>

namespace mirrorbake::gltf {

/// Calls `visit` for every node of the file's default scene (of all root nodes, if it has none), parents
/// first, with the transform from the node to the world whose zero is at `origin`. Throws FileError if a node
/// has two parents, is its own ancestor or has a transform that is not finite.
void visit_nodes(const std::string& path, const tinygltf::Model& model, glm::dvec3 origin,
                 const std::function<void(int index, const tinygltf::Node& node,
                                          const glm::dmat4& world_from_node)>& visit);

}  // namespace mirrorbake::gltf
