#include <filesystem>
#include <string>

#include "file_bytes.hpp"
#include "mtl.hpp"
#include "obj_libraries.hpp"
#include "readers.hpp"

namespace mirrorbake {

void find_obj_references(const std::string& path, FileContent content, References& found) {
  if (content == FileContent::mesh) return;
  for (const std::string& names : material_libraries(read_file(path))) {
    for (const std::string& name : library_files(path, names)) {
      if (!found.add(name)) continue;
      const std::filesystem::path library = *resolve_inside(found.directory(), name);
      Warnings ignored;
      for (const mtl::Definition& d : mtl::parse(read_file(library), ignored)) {
        for (const mtl::Map* map : {&d.diffuse_map, &d.specular_map, &d.emission_map, &d.dissolve_map}) {
          if (!map->file.empty()) found.add(library.parent_path(), map->file);
        }
      }
    }
  }
}

}  // namespace mirrorbake
