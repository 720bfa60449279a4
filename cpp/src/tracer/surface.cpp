#include "surface.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include "barycentric.hpp"
#include "mirrorbake/envmap/footprint.hpp"

namespace mirrorbake::tracing {
namespace {

// A shading normal can send the mirror direction below the geometric surface. Such a direction is raised just
// above the horizon and the normal replaced by the half vector that reflects the view into it, so that
// reflection, Fresnel term and the normal that is recorded belong together (as in Keller et al., The Iray
// Light Transport Simulation and Rendering System, 2017, appendix A.3).
constexpr float kLowestReflection = 0.01F;  // cosine to the geometric normal

// A roughness texture may hold 0, where the lobe has no density; this one is narrower than float directions
// resolve.
constexpr float kSmoothest = 1e-4F;

glm::vec3 reflect_about(glm::vec3 view, glm::vec3 n) { return 2.0F * glm::dot(n, view) * n - view; }

glm::vec3 bend_normal(glm::vec3 view, glm::vec3 n, glm::vec3 geometric) {
  if (const float c = glm::dot(n, view); c < 0.0F) n = glm::normalize(n - c * view);
  const glm::vec3 r = reflect_about(view, n);
  const float height = glm::dot(r, geometric);
  const float lowest = std::min(kLowestReflection, 0.9F * glm::dot(view, geometric));
  if (height >= lowest) return n;
  const glm::vec3 raised = glm::normalize(r + (lowest - height) * geometric);
  const glm::vec3 half = view + raised;
  const float length = glm::length(half);
  return length > 0.0F ? half / length : geometric;
}

// The direction in which u grows on a triangle, of any length, and the sign of the bitangent: those of the
// vertices, else of the triangle's plane. 0 where there is none.
glm::vec4 tangent_of(const TriangleMesh& mesh, glm::uvec3 t, glm::vec2 barycentric,
                     const std::array<glm::vec3, 3>& corners) {
  if (!mesh.tangents.empty() && mesh.tangents[t.x].w * mesh.tangents[t.y].w * mesh.tangents[t.z].w != 0.0F) {
    const glm::vec4 along = interpolate(mesh.tangents, t, barycentric);
    return {glm::vec3(along), std::copysign(1.0F, along.w)};
  }
  if (mesh.uvs.empty()) return glm::vec4(0.0F);
  const glm::vec2 du = mesh.uvs[t.y] - mesh.uvs[t.x];
  const glm::vec2 dv = mesh.uvs[t.z] - mesh.uvs[t.x];
  const float determinant = du.x * dv.y - du.y * dv.x;
  if (determinant == 0.0F) return glm::vec4(0.0F);
  const glm::vec3 e1 = corners[1] - corners[0];
  const glm::vec3 e2 = corners[2] - corners[0];
  const float sign = std::copysign(1.0F, determinant);
  return {sign * (dv.y * e1 - du.y * e2), sign};
}

// The shading normal bent by a texture (glTF 2.0 §3.9.3). Tangents are made upright to the normal that is
// interpolated over the triangle.
glm::vec3 mapped_normal(const Scene& scene, const TriangleMesh& mesh, const Surface& s, glm::vec2 barycentric,
                        const std::array<glm::vec3, 3>& corners, glm::vec3 normal) {
  const Material& material = *s.material;
  const glm::vec4 along = tangent_of(mesh, mesh.triangles[s.triangle], barycentric, corners);
  const glm::vec3 upright = glm::vec3(along) - glm::dot(glm::vec3(along), normal) * normal;
  const float length = glm::length(upright);
  if (!(length > 0.0F)) return normal;
  const glm::vec3 tangent = upright / length;
  const glm::vec3 bitangent = along.w * glm::cross(normal, tangent);
  const glm::vec3 texel =
      texture_lookup(scene, material.normal_texture, uv_at(mesh, s.triangle, barycentric)) * 2.0F - 1.0F;
  const glm::vec3 bent = material.normal_scale * (texel.x * tangent + texel.y * bitangent) + texel.z * normal;
  const float size = glm::length(bent);
  // One that leaves the triangle's front is a defect of the texture.
  const glm::vec3 front = triangle_normal(corners[0], corners[1], corners[2]);
  return size > 1e-6F && glm::dot(bent, front) > 0.0F ? bent / size : normal;
}

// The unit shading normal on the triangle's front, of the surface's triangle at any place in its plane.
glm::vec3 front_normal(const Scene& scene, const TriangleMesh& mesh, const Surface& s, glm::vec2 barycentric,
                       const std::array<glm::vec3, 3>& corners) {
  const glm::vec3 geometric = triangle_normal(corners[0], corners[1], corners[2]);
  glm::vec3 normal = geometric;
  if (!mesh.normals.empty()) {
    const glm::vec3 n = interpolate(mesh.normals, mesh.triangles[s.triangle], barycentric);
    const float length = glm::length(n);
    // A normal on the wrong side of its triangle is a defect of the mesh.
    if (length > 1e-6F && glm::dot(n, geometric) > 0.0F) normal = n / length;
  }
  if (s.material->normal_texture.texture < 0) return normal;
  return mapped_normal(scene, mesh, s, barycentric, corners, normal);
}

}  // namespace

glm::vec3 small_triangle_normal(glm::vec3 a, glm::vec3 b, glm::vec3 c) {
  const glm::dvec3 n = glm::cross(glm::dvec3(b) - glm::dvec3(a), glm::dvec3(c) - glm::dvec3(a));
  const double length = glm::length(n);
  return length > 0.0 ? glm::vec3(n / length) : glm::vec3(0.0F);
}

glm::vec3 fresnel_at(const Surface& surface, float cosine) {
  if (surface.reflectance_scale == glm::vec3(1.0F)) return evaluate(surface.material->fresnel, cosine);
  Fresnel fresnel = surface.material->fresnel;
  fresnel.r0 *= surface.reflectance_scale;
  return evaluate(fresnel, cosine);
}

Surface surface_at(const Scene& scene, const RayScene& rays, const Hit& hit, glm::vec3 ray_direction) {
  Surface s;
  s.object = static_cast<int>(hit.geometry);
  s.triangle = hit.triangle;
  s.barycentric = {hit.u, hit.v};
  const Object& object = scene.objects[hit.geometry];
  const TriangleMesh& mesh = object.mesh;
  s.material = &scene.materials[static_cast<std::size_t>(material_of(object, hit.triangle))];

  const glm::uvec3 corner = mesh.triangles[hit.triangle];
  const std::span<const glm::vec3> positions = rays.positions(s.object);
  const glm::vec3 a = positions[corner.x];
  const glm::vec3 b = positions[corner.y];
  const glm::vec3 c = positions[corner.z];
  s.position = interpolate(positions, corner, s.barycentric);
  // The interpolation is off by a few roundings of the largest coordinate, and so is the intersector's own
  // arithmetic, in which the axes mix: 8 roundings cover both (tests trace from 1e-3 m to 1e5 m).
  const glm::vec3 largest = glm::max(glm::abs(a), glm::max(glm::abs(b), glm::abs(c)));
  s.position_error = 8.0F * 0x1p-24F * std::max(largest.x, std::max(largest.y, largest.z));
  s.view = -ray_direction;

  s.geometric_normal = triangle_normal(a, b, c);
  s.front = glm::dot(s.geometric_normal, s.view) >= 0.0F;
  s.normal = front_normal(scene, mesh, s, s.barycentric, {a, b, c});
  if (!s.front) {
    s.geometric_normal = -s.geometric_normal;
    s.normal = -s.normal;
  } else {
    s.emission = s.material->emission;
    if (s.material->emission_texture.texture >= 0 && s.emission != glm::vec3(0.0F)) {
      s.emission *=
          texture_lookup(scene, s.material->emission_texture, uv_at(mesh, s.triangle, s.barycentric));
    }
  }

  s.albedo = s.material->albedo;
  if (s.material->albedo_texture.texture >= 0 && s.albedo != glm::vec3(0.0F)) {
    s.albedo *= texture_lookup(scene, s.material->albedo_texture, uv_at(mesh, s.triangle, s.barycentric));
  }
  const glm::vec3 color =
      mesh.colors.empty() ? glm::vec3(1.0F) : interpolate(mesh.colors, corner, s.barycentric);
  s.albedo *= color;
  if (s.material->specular) {
    s.normal = bend_normal(s.view, s.normal, s.geometric_normal);
    s.reflection = glm::normalize(reflect_about(s.view, s.normal));
    if (s.material->specular_texture.texture >= 0) {
      s.reflectance_scale =
          texture_lookup(scene, s.material->specular_texture, uv_at(mesh, s.triangle, s.barycentric));
    }
    if (s.material->colors_tint_reflectance) s.reflectance_scale *= color;
    s.fresnel = fresnel_at(s, glm::dot(s.normal, s.view));
    if (s.material->lobe == SpecularLobe::ggx) {
      s.roughness = s.material->roughness;
      if (s.material->roughness_texture.texture >= 0) {
        s.roughness *=
            texture_lookup(scene, s.material->roughness_texture, uv_at(mesh, s.triangle, s.barycentric)).x;
      }
      s.roughness = std::max(s.roughness, kSmoothest);
    }
    if (s.material->layers == LayerModel::coated) s.albedo *= 1.0F - s.fresnel;
  } else {
    s.reflection = reflect_about(s.view, s.normal);
  }
  return s;
}

// Pharr, Jakob, Humphreys, Physically Based Rendering, 3rd ed., §3.9.5.
glm::vec3 offset_origin(const Surface& surface, glm::vec3 direction) {
  const glm::vec3 n = surface.geometric_normal;
  const float distance = surface.position_error * (std::abs(n.x) + std::abs(n.y) + std::abs(n.z));
  const glm::vec3 offset = glm::dot(n, direction) >= 0.0F ? distance * n : -distance * n;
  glm::vec3 origin = surface.position + offset;
  for (int i = 0; i < 3; ++i) {
    if (offset[i] > 0.0F) origin[i] = std::nextafter(origin[i], std::numeric_limits<float>::infinity());
    if (offset[i] < 0.0F) origin[i] = std::nextafter(origin[i], -std::numeric_limits<float>::infinity());
  }
  return origin;
}

SurfaceDifferential surface_differential(const Scene& scene, const RayScene& rays, const Surface& surface,
                                         float distance, glm::vec3 ddirection) {
  // Transfer: the point slides in the plane of the triangle. Near the silhouette its speed grows without
  // limit; there the surface curves away before it is reached, so the cosine is kept above a tenth.
  const glm::vec3 d = -surface.view;
  const glm::vec3 g = surface.geometric_normal;
  const float cosine = std::min(glm::dot(d, g), -0.1F);
  const glm::vec3 travel = distance * ddirection;
  const float along = glm::dot(travel, g);
  SurfaceDifferential result;
  result.position = travel - (along / cosine) * d;
  result.position -= glm::dot(result.position, g) * g;

  // Reflection: r = d − 2 (d·n) n, with the normal's change from the change of the barycentric coordinates.
  const TriangleMesh& mesh = scene.objects[static_cast<std::size_t>(surface.object)].mesh;
  const bool is_mapped = surface.material->normal_texture.texture >= 0;
  glm::vec3 dnormal(0.0F);
  if (!mesh.normals.empty() || is_mapped) {
    const glm::uvec3 corner = mesh.triangles[surface.triangle];
    const std::span<const glm::vec3> positions = rays.positions(surface.object);
    const glm::dvec3 e1 = glm::dvec3(positions[corner.y]) - glm::dvec3(positions[corner.x]);
    const glm::dvec3 e2 = glm::dvec3(positions[corner.z]) - glm::dvec3(positions[corner.x]);
    const glm::dvec3 dp = result.position;
    const double e11 = glm::dot(e1, e1);
    const double e12 = glm::dot(e1, e2);
    const double e22 = glm::dot(e2, e2);
    const double determinant = e11 * e22 - e12 * e12;
    if (determinant > 0.0) {
      const double p1 = glm::dot(dp, e1);
      const double p2 = glm::dot(dp, e2);
      const auto du = static_cast<float>((p1 * e22 - p2 * e12) / determinant);
      const auto dv = static_cast<float>((p2 * e11 - p1 * e12) / determinant);
      glm::vec3 change;
      if (is_mapped) {
        // Texels have no derivative worth the name; the difference over the pixel is what a GPU takes.
        const std::array<glm::vec3, 3> corners{positions[corner.x], positions[corner.y], positions[corner.z]};
        change = front_normal(scene, mesh, surface, surface.barycentric + glm::vec2(du, dv), corners) -
                 front_normal(scene, mesh, surface, surface.barycentric, corners);
      } else {
        const glm::vec3 n0 = mesh.normals[corner.x];
        const glm::vec3 n1 = mesh.normals[corner.y];
        const glm::vec3 n2 = mesh.normals[corner.z];
        const glm::vec3 n = interpolate(mesh.normals, corner, surface.barycentric);
        change = ((n1 - n0) * du + (n2 - n0) * dv) / std::max(glm::length(n), 1e-6F);
      }
      dnormal = (surface.front ? 1.0F : -1.0F) * (change - glm::dot(change, surface.normal) * surface.normal);
    }
  }
  const glm::vec3 n = surface.normal;
  result.reflection = reflected_differential(d, n, ddirection, dnormal);
  // Directions differ by 2 at most; a longer differential is an artefact of the linear extrapolation.
  const float length = glm::length(result.reflection);
  if (!(length <= 2.0F))
    result.reflection = length < 1e30F ? result.reflection * (2.0F / length) : glm::vec3(0.0F);
  return result;
}

}  // namespace mirrorbake::tracing
