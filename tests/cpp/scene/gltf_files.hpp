#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "temporary_files.hpp"

namespace mirrorbake::testing {

/// A document of one quadrilateral (0,0,0)…(1,1,0) that tests fill with materials, nodes and what else they
/// need.
struct GltfScene {
  std::string nodes = R"([{"mesh":0,"name":"quad"}])";
  std::string roots = "[0]";
  std::string materials = "[]";
  std::string primitives =
      R"([{"attributes":{"POSITION":0,"TEXCOORD_0":1,"TEXCOORD_1":2},"indices":3,"material":0}])";
  std::string meshes;  ///< more of them, each after a comma
  std::string extra;   ///< further members, each with a comma after it

  static std::string buffer() {
    return bytes_of(std::vector<float>{0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 1, 0}) +
           bytes_of(std::vector<float>{0, 1, 1, 1, 1, 0, 0, 0}) +
           bytes_of(std::vector<float>{0, 2, 2, 2, 2, 0, 0, 0}) +
           bytes_of(std::vector<std::uint16_t>{0, 1, 2, 0, 2, 3});
  }

  std::string json() const {
    const std::string bytes = buffer();
    return R"({"asset":{"version":"2.0"},"scene":0,"scenes":[{"nodes":)" + roots + R"(}],)" + extra +
           R"("nodes":)" + nodes + R"(,"materials":)" + materials + R"(,"meshes":[{"primitives":)" +
           primitives + "}" + meshes +
           R"(],"accessors":[{"bufferView":0,"componentType":5126,"count":4,"type":"VEC3"},
      {"bufferView":1,"componentType":5126,"count":4,"type":"VEC2"},
      {"bufferView":2,"componentType":5126,"count":4,"type":"VEC2"},
      {"bufferView":3,"componentType":5123,"count":6,"type":"SCALAR"}],
      "bufferViews":[{"buffer":0,"byteLength":48},{"buffer":0,"byteOffset":48,"byteLength":32},
      {"buffer":0,"byteOffset":80,"byteLength":32},{"buffer":0,"byteOffset":112,"byteLength":12}],
      "buffers":[{"uri":"data:application/octet-stream;base64,)" +
           base64(bytes) + R"(","byteLength":)" + std::to_string(bytes.size()) + "}]}";
  }
};

}  // namespace mirrorbake::testing
