#include "irregular_texels.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <numbers>

#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/trigonometric.hpp>

#include "mirrorbake/envmap/texel_lookup.hpp"
#include "mirrorbake/projection/traits.hpp"

namespace mirrorbake {

IrregularTexels::IrregularTexels(const ResampleJob& job)
    : job_(job),
      limits_(straight_limits(job.source, job.target)),
      limits_of_parts_(limits_of_parts(job.source, limits_)),
      interpolated_(job.row_weights()) {}

TexelCorner IrregularTexels::corner(int face, double x, double y) const {
  const glm::dvec3 d = job_.direction(face, x, y);
  const MapPoint point = point_from_direction(job_.projection(), d);
  if (!point.covered) {
    // Beyond a fisheye's field of view: where the projection goes on, not on the rim.
    if (const auto beyond = point_on_face(job_.projection(), 0, d))
      return {d, 0, job_.position(beyond->x, beyond->y)};
  }
  return {d, point.face, job_.position(point.x, point.y)};
}

IrregularTexels::Corners IrregularTexels::corners(int face, glm::dvec2 low, glm::dvec2 high) const {
  return {corner(face, low.x, low.y), corner(face, high.x, low.y), corner(face, high.x, high.y),
          corner(face, low.x, high.y)};
}

bool IrregularTexels::covered(const TexelCorner& corner) const {
  return point_from_direction(job_.projection(), corner.direction).covered;
}

FaceTexel IrregularTexels::texel(const TexelCorner& corner) const {
  return {corner.face, std::clamp(static_cast<int>(corner.position.y), 0, job_.height() - 1),
          std::clamp(static_cast<int>(corner.position.x), 0, job_.width() - 1)};
}

// The texel in the plane of the source face of its first corner.
std::optional<Quad> IrregularTexels::quad_on_face(const Corners& corners) const {
  Quad quad;
  for (std::size_t i = 0; i < 4; ++i) {
    if (corners[i].face == corners[0].face) {
      quad[i] = corners[i].position;
    } else {
      const std::optional<glm::dvec2> point =
          point_on_face(job_.projection(), corners[0].face, corners[i].direction);
      if (!point) return std::nullopt;
      quad[i] = job_.position(point->x, point->y);
    }
  }
  if (job_.is_periodic()) {
    for (glm::dvec2& p : quad) {
      if (p.x - quad[0].x > 0.5 * job_.width()) p.x -= job_.width();
      if (p.x - quad[0].x < -0.5 * job_.width()) p.x += job_.width();
    }
  }
  return quad;
}

std::optional<std::span<const Tap>> IrregularTexels::find(int face, glm::dvec2 low, glm::dvec2 high) {
  taps_.clear();
  polygons_ = 0;
  const Corners around = corners(face, low, high);
  const glm::dvec2 middle = 0.5 * (low + high);
  clipped_ = disc_extent(job_.target.projection.kind, low, high) == DiscExtent::crosses_rim;
  double share = 0.0;
  if (job_.filter == ResampleFilter::automatic) {
    share = interpolated_share(texels_across(face, low, high));
    if (share > 0.0 && traits(job_.projection().kind).rim == Rim::singular) {
      share *= interpolable(job_.source, corner(face, middle.x, middle.y).position);
    }
  }
  for (const Content content : {Content::constant_texels, Content::interpolated}) {
    const double part = content == Content::interpolated ? share : 1.0 - share;
    if (part == 0.0) continue;
    start(content);
    gather(face, low, high, around, 0);
    if (too_many_) return std::nullopt;
    if (total_ == 0.0) {
      // A texel without area, such as one beyond the rim of a sphere map, which is all one direction.
      const TexelCorner center = corner(face, middle.x, middle.y);
      if (!covered(center)) continue;
      gather_point(center, 1.0);
    }
    take_part(part);
  }
  if (polygons_ > 1) merge(taps_);
  return taps_;
}

std::optional<std::span<const Tap>> IrregularTexels::find_straight(int face, const Quad& quad, double share) {
  taps_.clear();
  for (const Content content : {Content::constant_texels, Content::interpolated}) {
    const double part = content == Content::interpolated ? share : 1.0 - share;
    if (part == 0.0) continue;
    start(content);
    gather_polygon(face, quad);
    if (too_many_) return std::nullopt;
    if (total_ == 0.0) gather_point({{}, face, quad[0]}, 1.0);
    take_part(part);
  }
  return taps_;
}

void IrregularTexels::take_part(double share) {
  for (const Tap& tap : part_) taps_.push_back({tap.texel, share / total_ * tap.weight});
}

double IrregularTexels::stream(int face, glm::dvec2 low, glm::dvec2 high,
                               const std::function<void(std::span<const Tap>)>& consume) {
  start(Content::constant_texels);
  consume_ = &consume;
  clipped_ = disc_extent(job_.target.projection.kind, low, high) == DiscExtent::crosses_rim;
  gather(face, low, high, corners(face, low, high), 0);
  consume(part_);
  consume_ = nullptr;
  return total_;
}

void IrregularTexels::start(Content content) {
  content_ = content;
  too_many_ = false;
  part_.clear();
  total_ = 0.0;
}

void IrregularTexels::add(const FaceTexel& texel, double weight) {
  if (too_many_ || !(weight > 0.0)) return;
  if (part_.size() == kMostTaps) {
    if (consume_ != nullptr) {
      (*consume_)(part_);
      part_.clear();
    } else {
      merge(part_);
      too_many_ = part_.size() > kMostTaps / 2;
      if (too_many_) return;
    }
  }
  part_.push_back({texel, weight});
  total_ += weight;
}

void IrregularTexels::merge(std::vector<Tap>& taps) {
  // Down to the weight, so that the order of equal texels does not depend on the library.
  const auto number = [](const FaceTexel& texel) {
    return (static_cast<std::uint64_t>(texel.face) << 34U) + (static_cast<std::uint64_t>(texel.row) << 17U) +
           static_cast<std::uint64_t>(texel.column);
  };
  std::sort(taps.begin(), taps.end(), [&](const Tap& a, const Tap& b) {
    const std::uint64_t first = number(a.texel);
    const std::uint64_t second = number(b.texel);
    return first != second ? first < second : a.weight < b.weight;
  });
  std::size_t count = 0;
  for (const Tap& tap : taps) {
    if (count > 0 && taps[count - 1].texel == tap.texel) {
      taps[count - 1].weight += tap.weight;
    } else {
      taps[count++] = tap;
    }
  }
  taps.resize(count);
}

// As in ResampleKernels::classify(), with derivatives at the texel's centre for its edges.
double IrregularTexels::texels_across(int face, glm::dvec2 low, glm::dvec2 high) const {
  const glm::dvec2 middle = 0.5 * (low + high);
  const MapJacobian of_target = map_jacobian(job_.target.projection, face, middle.x, middle.y);
  const MapPoint at = point_from_direction(job_.projection(), job_.direction(face, middle.x, middle.y));
  const MapJacobian of_source = map_jacobian(job_.projection(), at.face, at.x, at.y);
  // Per texel of the source, orthogonalised: (p, 0) and (shear, q).
  const glm::dvec3 dx = 2.0 / job_.width() * of_source.dx;
  const glm::dvec3 dy = 2.0 / job_.height() * of_source.dy;
  const double p = std::max(glm::length(dx), 1e-9);
  const double shear = glm::dot(dx, dy) / p;
  const double q = std::max(std::sqrt(std::max(0.0, glm::dot(dy, dy) - shear * shear)), 1e-9);
  const auto in_texels = [&](glm::dvec3 change) {
    change = job_.source_from_target * change;
    const double y = (glm::dot(dy, change) - shear / p * glm::dot(dx, change)) / (q * q);
    return glm::dvec2(glm::dot(dx, change) / (p * p) - shear / p * y, y);
  };
  const glm::dvec2 a = in_texels((high.x - low.x) * of_target.dx);
  const glm::dvec2 b = in_texels((high.y - low.y) * of_target.dy);
  return texel_side(std::abs(cross(a, b)), glm::dot(a, a) + glm::dot(b, b));
}

void IrregularTexels::gather(int face, glm::dvec2 low, glm::dvec2 high, const Corners& corners, int depth) {
  if (too_many_) return;
  const DiscExtent place =
      clipped_ ? disc_extent(job_.target.projection.kind, low, high) : DiscExtent::inside;
  if (place == DiscExtent::outside) return;
  if (job_.is_periodic()) {
    if (!gather_outline(face, low, high, corners, place)) split(face, low, high, corners, depth);
    return;
  }
  // Faces of the source that the corners lie on; a face that only the inside of the texel touches is a
  // sliver.
  std::array<int, 4> faces{};
  std::size_t count = 0;
  for (const TexelCorner& corner : corners) {
    const auto end = faces.begin() + static_cast<std::ptrdiff_t>(count);
    if (std::find(faces.begin(), end, corner.face) == end) faces[count++] = corner.face;
  }
  // A texel across the rim of paraboloids lies on both, which go on beyond it: every part of it counts once.
  const bool crosses_paraboloids = count > 1 && traits(job_.projection().kind).rim == Rim::neighbour;
  if (crosses_paraboloids && depth >= kDeepestOnRim) {
    const glm::dvec2 middle = 0.5 * (low + high);
    faces[0] = corner(face, middle.x, middle.y).face;
    count = 1;
  }
  std::array<Quad, 4> quads;
  bool regular = place == DiscExtent::inside && !(crosses_paraboloids && depth < kDeepestOnRim);
  bool too_long = false;
  for (std::size_t f = 0; f < count && regular; ++f) {
    Corners seen = corners;
    // The face under consideration comes first, the order around the texel stays.
    while (seen[0].face != faces[f]) std::rotate(seen.begin(), seen.begin() + 1, seen.end());
    const std::optional<Quad> quad = quad_on_face(seen);
    const StraightLimits& limits = depth == 0 ? limits_ : limits_of_parts_;
    too_long = too_long || !quad || !(length_of(*quad) < limits.length);
    regular = quad && !too_long && is_straight(*quad, limits);
    if (regular) quads[f] = *quad;
  }
  if (regular) {
    for (std::size_t f = 0; f < count; ++f) gather_polygon(faces[f], quads[f]);
    return;
  }
  const glm::dvec2 middle = 0.5 * (low + high);
  const int deepest = place == DiscExtent::crosses_rim ? kDeepestOnRim : too_long ? kDeepestIfLong : kDeepest;
  if (depth >= deepest) {
    const TexelCorner center = corner(face, middle.x, middle.y);
    if (!covered(center) || (clipped_ && glm::dot(middle, middle) > 1.0)) return;
    const double density = solid_angle_density(job_.target.projection, face, middle.x, middle.y);
    gather_point(center, density * std::abs((high.x - low.x) * (high.y - low.y)));
    return;
  }
  split(face, low, high, corners, depth);
}

void IrregularTexels::split(int face, glm::dvec2 low, glm::dvec2 high, const Corners& corners, int depth) {
  const glm::dvec2 middle = 0.5 * (low + high);
  // The corners of the four parts, row by row; the outer ones are known.
  const TexelCorner center = corner(face, middle.x, middle.y);
  const TexelCorner top = corner(face, middle.x, low.y);
  const TexelCorner right = corner(face, high.x, middle.y);
  const TexelCorner bottom = corner(face, middle.x, high.y);
  const TexelCorner left = corner(face, low.x, middle.y);
  gather(face, low, middle, {corners[0], top, center, left}, depth + 1);
  gather(face, {middle.x, low.y}, {high.x, middle.y}, {top, corners[1], right, center}, depth + 1);
  gather(face, {low.x, middle.y}, {middle.x, high.y}, {left, center, bottom, corners[3]}, depth + 1);
  gather(face, middle, high, {center, right, corners[2], bottom}, depth + 1);
}

// The image of a texel in a panorama, as a polygon. Nothing if the texel is so large that its outline may not
// tell the inside from the outside, or reaches over too many texels of the source.
bool IrregularTexels::gather_outline(int face, glm::dvec2 low, glm::dvec2 high, const Corners& corners,
                                     DiscExtent place) {
  constexpr double kNear = 0.8;  // cosine of the angle between the centre of a texel and its corners
  constexpr double kMostCells = 1 << 18;
  const glm::dvec3 center = corner(face, 0.5 * (low.x + high.x), 0.5 * (low.y + high.y)).direction;
  for (const TexelCorner& c : corners) {
    if (!(glm::dot(c.direction, center) > kNear)) return false;
  }
  outline_.clear();
  if (place == DiscExtent::inside) {
    trace_around(face, low, high);
  } else {
    trace_within_disc(face, low, high);
  }
  unroll_outline();
  if (polygon_.empty()) return true;
  glm::dvec2 first = polygon_[0];
  glm::dvec2 last = first;
  for (const glm::dvec2 p : polygon_) first = glm::min(first, p), last = glm::max(last, p);
  const glm::dvec2 size = last - first + 2.0;
  if (size.x * size.y > kMostCells) return false;
  gather_polygon(0, polygon_);
  return true;
}

IrregularTexels::OutlinePoint IrregularTexels::outline_point(int face, glm::dvec2 at) const {
  return {at, corner(face, at.x, at.y).position};
}

bool IrregularTexels::is_pole(glm::dvec2 position) const {
  constexpr double kRounding = 1e-6;
  return position.y < kRounding || position.y > job_.height() - kRounding;
}

// A column of a panorama at most half a turn away from another.
double IrregularTexels::unrolled(double x, double near) const {
  return x - job_.width() * std::round((x - near) / job_.width());
}

// From a point that is known to another, but for the first one, by chords that hardly differ from the curve.
void IrregularTexels::trace(int face, const OutlinePoint& from, const OutlinePoint& to, bool along_rim,
                            int depth) {
  constexpr int kDeepestEdge = 20;
  constexpr double kDeviation = 0.02;            // in texels
  constexpr double kDeviationPerLength = 0.002;  // of long chords
  glm::dvec2 at = 0.5 * (from.at + to.at);
  if (along_rim) at = glm::normalize(at);
  const OutlinePoint middle = outline_point(face, at);
  glm::dvec2 a = from.position;
  glm::dvec2 m = middle.position;
  glm::dvec2 b = to.position;
  // The column of a pole is that from which it is seen.
  if (is_pole(a)) a.x = is_pole(m) ? b.x : m.x;
  m.x = is_pole(m) ? a.x : unrolled(m.x, a.x);
  b.x = is_pole(b) ? m.x : unrolled(b.x, m.x);
  const glm::dvec2 bend = glm::abs(m - 0.5 * (a + b));
  const glm::dvec2 chord = glm::abs(b - a);
  const double limit = std::max(kDeviation, kDeviationPerLength * std::max(chord.x, chord.y));
  if (depth > 0 && (bend.x + bend.y <= limit || depth >= kDeepestEdge)) {
    outline_.push_back(middle.position);
    outline_.push_back(to.position);
    return;
  }
  trace(face, from, middle, along_rim, depth + 1);
  trace(face, middle, to, along_rim, depth + 1);
}

void IrregularTexels::trace_around(int face, glm::dvec2 low, glm::dvec2 high) {
  const std::array<OutlinePoint, 4> points = {outline_point(face, low), outline_point(face, {high.x, low.y}),
                                              outline_point(face, high),
                                              outline_point(face, {low.x, high.y})};
  for (std::size_t i = 0; i < 4; ++i) trace(face, points[i], points[(i + 1) % 4], false, 0);
}

// The part of the rectangle in the unit disc: where its sides leave the disc, it goes on along the rim.
void IrregularTexels::trace_within_disc(int face, glm::dvec2 low, glm::dvec2 high) {
  const std::array<glm::dvec2, 4> corners = {low, glm::dvec2(high.x, low.y), high, glm::dvec2(low.x, high.y)};
  const auto is_same = [](glm::dvec2 a, glm::dvec2 b) { return glm::dot(a - b, a - b) < 1e-18; };
  std::optional<OutlinePoint> first;
  std::optional<OutlinePoint> before;
  for (std::size_t i = 0; i < 4; ++i) {
    const glm::dvec2 a = corners[i];
    const glm::dvec2 side = corners[(i + 1) % 4] - a;
    // |a + t side|² = 1
    const double q = glm::dot(side, side);
    const double p = glm::dot(a, side) / q;
    const double discriminant = p * p - (glm::dot(a, a) - 1.0) / q;
    if (!(discriminant > 0.0)) continue;
    const double enter = std::max(0.0, -p - std::sqrt(discriminant));
    const double leave = std::min(1.0, -p + std::sqrt(discriminant));
    if (!(enter < leave)) continue;
    const OutlinePoint from = outline_point(face, a + enter * side);
    const OutlinePoint to = outline_point(face, a + leave * side);
    if (before && !is_same(before->at, from.at)) trace(face, *before, from, true, 0);
    trace(face, from, to, false, 0);
    if (!first) first = from;
    before = to;
  }
  if (first && !is_same(before->at, first->at)) trace(face, *before, *first, true, 0);
}

// So that neighbours are at most half a turn apart. Along a pole the polygon goes from one column to the
// next; an outline that goes all around a pole is closed along it.
void IrregularTexels::unroll_outline() {
  polygon_.clear();
  const auto start =
      std::find_if(outline_.begin(), outline_.end(), [&](glm::dvec2 p) { return !is_pole(p); });
  if (start == outline_.end()) return;
  std::rotate(outline_.begin(), start, outline_.end());
  outline_.push_back(outline_.front());
  double x = outline_.front().x;
  bool after_pole = false;
  double sum = 0.0;
  for (const glm::dvec2 p : outline_) {
    sum += p.y;
    if (is_pole(p)) {
      after_pole = true;
      polygon_.push_back({x, p.y});
      continue;
    }
    x = unrolled(p.x, x);
    if (after_pole) polygon_.push_back({x, polygon_.back().y});
    after_pole = false;
    polygon_.push_back({x, p.y});
  }
  const double begin = polygon_.front().x;
  if (std::abs(x - begin) < 0.5 * job_.width()) return;
  const bool upper = sum < 0.5 * job_.height() * static_cast<double>(outline_.size());
  const double closed = upper ? 0.0 : job_.height();
  polygon_.push_back({x, closed});
  polygon_.push_back({begin, closed});
}

void IrregularTexels::gather_point(const TexelCorner& at, double weight) {
  ++polygons_;
  if (content_ == Content::constant_texels) return add(texel(at), weight);
  emit_bilinear(job_.source, at.face, at.position.x, at.position.y,
                [&](const FaceTexel& place, double share) { add(place, weight * share); });
}

void IrregularTexels::gather_polygon(int face, std::span<const glm::dvec2> corners) {
  ++polygons_;
  const int width = job_.width();
  const int height = job_.height();
  if (content_ == Content::interpolated) {
    double density = 1.0;
    if (job_.is_periodic()) {
      interpolated_.integrate(corners);
    } else {
      interpolated_.integrate(corners, {0.0, 0.0}, {width, height});
      glm::dvec2 middle(0.0);
      for (const glm::dvec2 p : corners) middle += p / static_cast<double>(corners.size());
      density = job_.weight(std::clamp(static_cast<int>(middle.y), 0, height - 1),
                            std::clamp(static_cast<int>(middle.x), 0, width - 1));
    }
    interpolated_.for_each_texel([&](int column, int row, double weight) {
      emit_texel(job_.source, face, row, column, density * weight,
                 [&](const FaceTexel& place, double share) { add(place, share); });
    });
    return;
  }
  coverage_.rasterize(corners);
  coverage_.for_each_pixel([&](int column, int row, double area) {
    if (row < 0 || row >= height) return;
    if (job_.is_periodic()) {
      column %= width;
      if (column < 0) column += width;
    }
    if (column < 0 || column >= width) return;
    add({face, row, column}, area * job_.weight(row, column));
  });
}

}  // namespace mirrorbake
