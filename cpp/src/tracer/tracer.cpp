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

const TracerOptions& validated(const TracerOptions& options) {
  check_range("cache_rays", options.cache_rays, 1, 65536);
  check_range("cache_bounces", options.cache_bounces, 1, 16);
  return options;
}

}  // namespace

Tracer::State::State(Scene scene, const TracerOptions& options)
    : lit((validated(scene), std::move(scene)), validated(options)) {}

void Tracer::State::check_object(const char* argument, int object) const {
  const auto count = static_cast<int>(lit.world.scene.objects.size());
  if (object < 0 || object >= count) {
    throw InvalidArgument(argument, std::to_string(object),
                          "an object number below " + std::to_string(count));
  }
}

Tracer::Tracer(Scene scene, const TracerOptions& options)
    : state_(std::make_unique<State>(std::move(scene), options)) {}
Tracer::~Tracer() = default;
Tracer::Tracer(Tracer&&) noexcept = default;
Tracer& Tracer::operator=(Tracer&&) noexcept = default;

const Scene& Tracer::scene() const { return state_->lit.world.scene; }

}  // namespace mirrorbake
