#pragma once

#include <cstdint>
#include <vector>
#include <glm/vec3.hpp>

#include "camera_rays.hpp"
#include "mirrorbake/surface/surface_samples.hpp"
#include "mirrorbake/tracer/tracer.hpp"
#include "pixel_layers.hpp"
#include "world.hpp"

/// How the samples of an image, which many threads trace, become one SurfaceSamples.
namespace mirrorbake::tracing {

/// One image row: its samples in order, and the beauty value of each where light is traced.
struct Row {
  SurfaceSamples samples;
  std::vector<glm::vec3> beauty;
};

void record_surface(SurfaceSamples& out, const World& world, const Surface& s, float distance,
                    const CameraRays::Direction& ray, std::uint32_t pixel);
void record_light(SurfaceSamples& out, glm::vec3 body, const IncidentShells& incident);

/// Behind the samples of every pixel's first round come those of the second: brings them together.
void sort_by_pixel(Row& row);

/// The rows one after the other, positions relative to `origin`. Empties them.
SurfaceSamples concatenate(std::vector<Row>& rows, const PixelWindow& window, const TraceOptions& options,
                           glm::dvec3 origin);

}  // namespace mirrorbake::tracing
