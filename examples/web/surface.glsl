// The surface at a place in the pixel, and how its reflection changes over the footprint of a lookup there: the rays'
// differentials (Igehy, SIGGRAPH 1999) on the plane of the triangle. Maps are inferred for exactly these.

struct Reflection {
  vec3 p, n, v, r;  // position, normal, direction to the eye, reflected direction
  vec3 px, py;      // change of the position over the footprint, to the right and down
  vec3 rx, ry;      // the same of the reflected direction
};

// A normal that reflects the eye into the surface is bent until it does not; g is the triangle's own normal.
vec3 bentNormal(vec3 v, vec3 n, vec3 g) {
  float c = dot(n, v);
  if (c < 0.0) n = normalize(n - c * v);
  vec3 r = 2.0 * dot(n, v) * n - v;
  float lowest = min(0.01, 0.9 * dot(v, g));
  if (dot(r, g) >= lowest) return n;
  vec3 middle = v + normalize(r + (lowest - dot(r, g)) * g);
  return length(middle) > 0.0 ? normalize(middle) : g;
}

vec3 reflectedChange(vec3 change, vec3 d, vec3 n, vec3 dn) {
  vec3 r = change - 2.0 * (dot(d, n) * dn + (dot(change, n) + dot(d, dn)) * n);
  float size = length(r);
  return size <= 2.0 ? r : (size < 1e30 ? r * (2.0 / size) : vec3(0.0));
}

// `position` and `normal` are interpolated from the vertices, in world space; `forward` is the direction in which the
// camera looks; `place` is where in the pixel, from its top left corner; `footprint` is in pixels.
Reflection reflectionAt(vec3 position, vec3 normal, vec3 eye, vec3 forward, vec2 place, float footprint) {
  vec3 px = dFdx(position), py = dFdy(position), nx = dFdx(normal), ny = dFdy(normal);
  // On the image plane at distance 1: this pixel, and one pixel to the right and down.
  vec3 q = (position - eye) / dot(position - eye, forward);
  vec3 right = dFdx(q), down = -dFdy(q);
  vec3 g = cross(px, py);
  g = length(g) > 0.0 ? normalize(g) : normalize(eye - position);
  if (dot(g, eye - position) < 0.0) g = -g;
  q += (place.x - 0.5) * right + (place.y - 0.5) * down;
  Reflection s;
  s.p = eye + q * (dot(position - eye, g) / min(dot(q, g), -1e-6));
  // What is linear on the triangle changes along any step of its plane as it does along the pixel's.
  float e11 = dot(px, px), e12 = dot(px, py), e22 = dot(py, py);
  float determinant = e11 * e22 - e12 * e12;
  mat2 inverse_ = determinant > 0.0 ? mat2(e22, -e12, -e12, e11) / determinant : mat2(0.0);
  vec2 moved = inverse_ * vec2(dot(s.p - position, px), dot(s.p - position, py));
  vec3 smooth_ = normal + moved.x * nx + moved.y * ny;
  float size = max(length(smooth_), 1e-6);
  float range = length(eye - s.p);
  s.v = (eye - s.p) / range;
  s.n = bentNormal(s.v, dot(smooth_, g) > 0.0 ? smooth_ / size : g, g);
  s.r = normalize(2.0 * dot(s.n, s.v) * s.n - s.v);
  vec3 d = -s.v;
  float slope = dot(d, forward);
  float cosine = min(dot(d, g), -0.1);
  for (int axis = 0; axis < 2; ++axis) {
    vec3 step_ = axis == 0 ? right : down;
    vec3 change = (step_ - dot(step_, d) * d) * slope;
    vec3 p = range * (change - (dot(change, g) / cosine) * d);
    p -= dot(p, g) * g;
    vec2 along = inverse_ * vec2(dot(p, px), dot(p, py));
    vec3 dn = (along.x * nx + along.y * ny) / size;
    vec3 r = footprint * reflectedChange(change, d, s.n, dn - dot(dn, s.n) * s.n);
    if (axis == 0) {
      s.px = footprint * p;
      s.rx = r;
    } else {
      s.py = footprint * p;
      s.ry = r;
    }
  }
  return s;
}
