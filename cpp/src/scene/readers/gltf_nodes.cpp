#include "gltf_nodes.hpp"

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include <glm/gtc/matrix_transform.hpp>
#include <glm/gtc/quaternion.hpp>

#include "gltf_document.hpp"

namespace mirrorbake::gltf {
namespace {

bool is_finite(const glm::dmat4& m) {
  for (int column = 0; column < 4; ++column) {
    for (int row = 0; row < 4; ++row) {
      if (!std::isfinite(m[column][row])) return false;
    }
  }
  return true;
}

void check_length(const std::string& path, const std::vector<double>& values, std::size_t length,
                  const char* what) {
  if (!values.empty() && values.size() != length) {
    fail(path, std::string("node ") + what + " has " + std::to_string(values.size()) + " numbers, expected " +
                   std::to_string(length));
  }
}

// glTF 2.0 §3.5.3: a matrix (column by column), or translation · rotation · scale.
glm::dmat4 parent_from_node(const std::string& path, const tinygltf::Node& node) {
  check_length(path, node.matrix, 16, "matrix");
  check_length(path, node.translation, 3, "translation");
  check_length(path, node.rotation, 4, "rotation");
  check_length(path, node.scale, 3, "scale");
  glm::dmat4 result(1.0);
  if (!node.matrix.empty()) {
    for (int i = 0; i < 16; ++i) result[i / 4][i % 4] = node.matrix[static_cast<std::size_t>(i)];
    return result;
  }
  if (!node.translation.empty()) {
    result = glm::translate(result, {node.translation[0], node.translation[1], node.translation[2]});
  }
  if (!node.rotation.empty()) {
    const glm::dquat q(node.rotation[3], node.rotation[0], node.rotation[1], node.rotation[2]);
    if (!(glm::length(q) > 1e-12)) fail(path, "node rotation is zero, expected a unit quaternion");
    result *= glm::mat4_cast(glm::normalize(q));
  }
  if (!node.scale.empty()) result = glm::scale(result, {node.scale[0], node.scale[1], node.scale[2]});
  return result;
}

std::vector<int> roots(const std::string& path, const tinygltf::Model& model) {
  if (!model.scenes.empty()) {
    return element(path, model.scenes, std::max(0, model.defaultScene), "default scene").nodes;
  }
  std::vector<bool> is_child(model.nodes.size(), false);
  for (const tinygltf::Node& node : model.nodes) {
    for (const int child : node.children) {
      element(path, model.nodes, child, "child node");
      is_child[static_cast<std::size_t>(child)] = true;
    }
  }
  std::vector<int> result;
  for (std::size_t i = 0; i < is_child.size(); ++i) {
    if (!is_child[i]) result.push_back(static_cast<int>(i));
  }
  return result;
}

}  // namespace

void visit_nodes(const std::string& path, const tinygltf::Model& model, glm::dvec3 origin,
                 const std::function<void(int, const tinygltf::Node&, const glm::dmat4&)>& visit) {
  struct Step {
    int node;
    glm::dmat4 world_from_parent;
  };
  std::vector<Step> stack;
  const std::vector<int> first = roots(path, model);
  const glm::dmat4 world_from_file = glm::translate(glm::dmat4(1.0), -origin);
  for (auto it = first.rbegin(); it != first.rend(); ++it) stack.push_back({*it, world_from_file});
  std::vector<bool> is_visited(model.nodes.size(), false);
  while (!stack.empty()) {
    const Step step = stack.back();
    stack.pop_back();
    const tinygltf::Node& node = element(path, model.nodes, step.node, "node");
    if (is_visited[static_cast<std::size_t>(step.node)]) {
      fail(path, "node " + std::to_string(step.node) + " is reached twice: nodes must form a tree");
    }
    is_visited[static_cast<std::size_t>(step.node)] = true;
    const glm::dmat4 world_from_node = step.world_from_parent * parent_from_node(path, node);
    if (!is_finite(world_from_node))
      fail(path, "node " + std::to_string(step.node) + " has a transform that is not finite");
    visit(step.node, node, world_from_node);
    for (auto it = node.children.rbegin(); it != node.children.rend(); ++it)
      stack.push_back({*it, world_from_node});
  }
}

}  // namespace mirrorbake::gltf
