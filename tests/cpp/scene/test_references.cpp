#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "gltf_files.hpp"
#include "mirrorbake/core/error.hpp"
#include "mirrorbake/scene/load.hpp"

namespace mirrorbake {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;

class References : public testing::FileTest {
 protected:
  std::vector<std::string> of(const std::string& path, FileContent content) const {
    std::vector<std::string> names;
    for (const std::string& file : referenced_files(path, content)) {
      EXPECT_TRUE(std::filesystem::path(file).is_absolute());
      names.push_back(std::filesystem::relative(file, std::filesystem::canonical(directory_)).string());
    }
    return names;
  }
};

TEST_F(References, OfGltfAreItsBuffersAndForScenesItsImages) {
  testing::GltfScene document;
  write("my data.bin", testing::GltfScene::buffer());
  write("maps/wood.png", "not read here");
  document.extra =
      R"("images":[{"uri":"maps/wood.png"},{"uri":"data:image/png;base64,AAAA"},{"uri":"maps/wood.png"}],)";
  std::string json = document.json();
  const std::size_t begin = json.find("data:application");
  json.replace(begin, json.find('"', begin) - begin, "my%20data.bin");
  const std::string path = write("scene.gltf", json);
  EXPECT_THAT(of(path, FileContent::mesh), ElementsAre("my data.bin"));
  EXPECT_THAT(of(path, FileContent::scene), ElementsAre("my data.bin", "maps/wood.png"));
  EXPECT_NO_THROW(load_mesh(path));
}

TEST_F(References, OfADocumentThatHoldsEverythingAreNone) {
  const std::string path = write("scene.gltf", testing::GltfScene().json());
  EXPECT_THAT(of(path, FileContent::scene), IsEmpty());
}

TEST_F(References, OfObjAreLibrariesThatExistAndTheirImages) {
  write("my paint.mtl",
        "newmtl red\nmap_Kd maps/a.png\nmap_Ke missing.png\nnewmtl blue\nmap_Kd maps/a.png\n");
  write("maps/a.png", "not read here");
  write("maps/b.png", "not read here");
  write("parts/steel.mtl", "newmtl steel\nmap_Kd -s 2 2 2 ../maps/b.png\nmap_Kd b.png\n");
  write("parts/b.png", "not read here");
  const std::string triangle = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";
  const std::string path =
      write("scene.obj", "mtllib my paint.mtl\nmtllib parts/steel.mtl none.mtl\n" + triangle);
  EXPECT_THAT(of(path, FileContent::scene),
              ElementsAre("my paint.mtl", "maps/a.png", "parts/steel.mtl", "parts/b.png"));
  // load_mesh reads triangles alone.
  EXPECT_THAT(of(path, FileContent::mesh), IsEmpty());
}

TEST_F(References, OutsideOfTheDirectoryAreNotFollowed) {
  write("secret.mtl", "newmtl a\nmap_Kd maps/a.png\n");
  const std::string path = write("inside/scene.obj", "mtllib ../secret.mtl\nv 0 0 0\n");
  EXPECT_THAT(of(path, FileContent::scene), IsEmpty());
  EXPECT_THROW(referenced_files((directory_ / "none.gltf").string(), FileContent::mesh), FileError);
}

TEST_F(References, OfAFileThatNoReaderTakesAreAnErrorThatNamesThoseThatAreRead) {
  const std::string path = write("scene.ply", "ply");
  for (const auto& read :
       std::vector<std::function<void()>>{[&] { referenced_files(path, FileContent::scene); },
                                          [&] { load_mesh(path); }, [&] { load_scene(path); }}) {
    EXPECT_THAT(read, ::testing::ThrowsMessage<FileError>(
                          ::testing::HasSubstr("has the extension '.ply', expected .obj, .gltf or .glb")));
  }
}

}  // namespace
}  // namespace mirrorbake
