#include "mirrorbake/tracer/tracer.hpp"
#include "mirrorbake/core/check.hpp"

#include <string>
#include <utility>

#include "mirrorbake/core/error.hpp"
#include "options.hpp"
#include "state.hpp"

namespace mirrorbake {
namespace {

const Scene& validated(const Scene& scene) {
  validate(scene);
  return scene;
}

const TracerOptions& validated(const TracerOptions& options, std::size_t objects) {
  check_range("cache_rays", options.cache_rays, 1, 65536);
  check_range("cache_bounces", options.cache_bounces, 1, 16);
  if (options.focus >= 0 && static_cast<std::size_t>(options.focus) >= objects) {
    throw InvalidArgument("focus", std::to_string(options.focus),
                          "an object number below " + std::to_string(objects) + ", or less than 0 for none");
  }
  return options;
}

}  // namespace

Tracer::State::State(Scene scene, const TracerOptions& options)
    : lit((validated(options, validated(scene).objects.size()), std::move(scene)), options) {}

void Tracer::State::check_object(const char* argument, int object) const {
  const auto count = static_cast<int>(lit.world.scene.objects.size());
  if (object < 0 || object >= count) {
    throw InvalidArgument(argument, std::to_string(object),
                          "an object number below " + std::to_string(count));
  }
}

Tracer::Tracer(Scene scene, const TracerOptions& options)
    : state_(std::make_unique<State>(std::move(scene), options)) {}
Tracer::Tracer(std::unique_ptr<State> state) : state_(std::move(state)) {}
Tracer::~Tracer() = default;
Tracer::Tracer(Tracer&&) noexcept = default;
Tracer& Tracer::operator=(Tracer&&) noexcept = default;

Tracer Tracer::with_parts(int object, std::vector<std::uint16_t> parts, std::vector<std::string> part_names,
                          std::vector<int> part_materials) const {
  state_->check_object("object", object);
  Scene scene = state_->lit.world.scene;
  Object& cut = scene.objects[static_cast<std::size_t>(object)];
  const Object before = cut;
  cut.mesh.parts = std::move(parts);
  cut.part_names = std::move(part_names);
  cut.part_materials = std::move(part_materials);
  validate(scene);
  for (std::size_t triangle = 0; triangle < cut.mesh.triangles.size(); ++triangle) {
    if (material_of(cut, triangle) == material_of(before, triangle)) continue;
    throw InvalidArgument("part_materials", "another material for triangle " + std::to_string(triangle),
                          "parts that keep the triangles' materials");
  }
  return Tracer(std::make_unique<State>(std::move(scene), state_->lit.indirect));
}

const Scene& Tracer::scene() const { return state_->lit.world.scene; }

}  // namespace mirrorbake
