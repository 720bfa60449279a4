#pragma once

#include <string>
#include <glm/vec3.hpp>

#include "mirrorbake/scene/scene.hpp"

/// The pieces that furnish the built-in room. Each call adds the objects of one piece and the materials it
/// needs.
namespace mirrorbake::furniture {

/// Adds to `scene` and remembers the materials that several pieces share.
class Furnisher {
 public:
  explicit Furnisher(Scene& scene);

  int texture(Image image);
  int matte(std::string name, glm::vec3 albedo);
  int matte(std::string name, int albedo_texture);
  /// Diffuse under a clear coat of index 1.5: glazed, varnished, waxed things.
  int glazed(std::string name, glm::vec3 albedo);
  void add(std::string name, TriangleMesh mesh, int material);

  int oak() const { return oak_; }
  int walnut() const { return walnut_; }
  int white_paint() const { return white_paint_; }
  int brass() const { return brass_; }

 private:
  Scene& scene_;
  int oak_, walnut_, white_paint_, brass_;
};

/// A table `height` high that stands on y = `floor`, its top centred on the y axis.
void add_table(Furnisher& f, float floor, float top_width, float top_depth);
/// A chair at `place` on the floor; at 0 degrees one sits on it looking along −Z.
void add_chair(Furnisher& f, const std::string& name, glm::vec3 place, float degrees, int cushion_material);
/// A sofa for two at `place` on the floor; at 0 degrees one sits on it looking along −Z.
void add_sofa(Furnisher& f, glm::vec3 place, float degrees);
/// A bookshelf whose back is in the plane z = `corner.z`, open towards +Z, filled with books.
void add_bookshelf(Furnisher& f, glm::vec3 corner, float width, float height);
void add_sideboard(Furnisher& f, glm::vec3 min, glm::vec3 max);
void add_floor_lamp(Furnisher& f, glm::vec3 place);
void add_potted_tree(Furnisher& f, glm::vec3 place);

// Things on the table, `place` on its top.
void add_cup_and_saucer(Furnisher& f, const std::string& name, glm::vec3 place, float degrees,
                        glm::vec3 colour);
void add_vase(Furnisher& f, glm::vec3 place);
void add_fruit(Furnisher& f, glm::vec3 place);
void add_draughts(Furnisher& f, glm::vec3 place, float degrees);
void add_book_pile(Furnisher& f, glm::vec3 place, float degrees);
/// A folded cloth, checkered, flat on the table.
void add_napkin(Furnisher& f, glm::vec3 place, float degrees);
void add_lemon(Furnisher& f, glm::vec3 place);
void add_toys(Furnisher& f, glm::vec3 place, float degrees);

}  // namespace mirrorbake::furniture
