// Where a reflected ray meets the surroundings: the direction in which a map is read, from its origin to the point
// where the ray from `p` along `d` leaves the map's proxy. Positions and lengths in metres. `proxyFromWorld` has the
// shape's own axes as rows. What comes back is not normalised.

vec3 lookupInfinite(vec3 p, vec3 d) {
  return d;
}

vec3 lookupBox(vec3 p, vec3 d, vec3 centre, mat3 proxyFromWorld, vec3 halfExtent, vec3 origin) {
  vec3 q = proxyFromWorld * (p - centre);
  vec3 e = proxyFromWorld * d;
  float t = 1e30;
  for (int i = 0; i < 3; ++i) {
    float wall = e[i] < 0.0 ? -halfExtent[i] : halfExtent[i];
    if (e[i] != 0.0) t = min(t, abs(wall - q[i]) / abs(e[i]));
  }
  return p + t * d - origin;
}

// How far the unit sphere is away from q along e, in lengths of e.
float sphereExit(vec3 q, vec3 e) {
  float a = dot(e, e);
  float b = dot(q, e);
  float c = dot(q, q) - 1.0;
  float s = sqrt(max(b * b - a * c, 0.0));
  return max(b > 0.0 ? -c / (b + s) : (s - b) / a, 0.0);  // of both forms of the root the one that does not cancel
}

vec3 lookupEllipsoid(vec3 p, vec3 d, vec3 centre, mat3 proxyFromWorld, vec3 radii, vec3 origin) {
  float t = sphereExit(proxyFromWorld * (p - centre) / radii, proxyFromWorld * d / radii);
  return p + t * d - origin;
}

// The half above its own y = 0 of a sphere, with a floor.
vec3 lookupHemisphere(vec3 p, vec3 d, vec3 centre, mat3 proxyFromWorld, float radius, vec3 origin) {
  vec3 q = proxyFromWorld * (p - centre) / radius;
  vec3 e = proxyFromWorld * d / radius;
  float t = sphereExit(q, e);
  if (e.y < 0.0) t = min(t, abs(q.y / e.y));
  return p + t * d - origin;
}

// A plane below what is at infinity: rays that do not come down to it keep their direction.
vec3 lookupPlane(vec3 p, vec3 d, vec3 point, vec3 normal, vec3 origin) {
  float speed = -dot(d, normal);
  if (speed <= 0.0) return d;
  return p + d * (max(dot(p - point, normal), 0.0) / speed) - origin;
}

// Texels that a change of a lookup is long, on the face of a cube map with `size` texels a side.
float texelsAcross(vec3 lookup, vec3 change, float size) {
  vec3 a = abs(lookup);
  float major = max(a.x, max(a.y, a.z));
  float along = a.x == major ? change.x / lookup.x : a.y == major ? change.y / lookup.y : change.z / lookup.z;
  return 0.5 * size * length(change - lookup * along) / major;
}

// Level of detail of a lookup that changes by `dx` and `dy` over the pixel. Taken from here and not from the driver,
// whose levels differ from card to card by more than the maps' own error.
float levelOfDetail(vec3 lookup, vec3 dx, vec3 dy, float size) {
  float texels = max(texelsAcross(lookup, dx, size), texelsAcross(lookup, dy, size));
  return clamp(log2(max(texels, 1.0)), 0.0, log2(size));
}

// The taps of a lookup: one, or pairs along the longer change of it, all of one level. They fade in as the footprint
// grows longer, so that no rounding decides how many there are.
struct Taps {
  float level;
  int pairs;  // 0: one tap in the middle
  float spacing;
  float cells;
  vec3 longer;
};

Taps tapsOf(vec3 lookup, vec3 dx, vec3 dy, float size, float maxTaps) {
  float x = texelsAcross(lookup, dx, size), y = texelsAcross(lookup, dy, size);
  Taps taps = Taps(0.0, 0, 0.0, 1.0, y > x ? dy : dx);
  if (!(max(x, y) > 1.0)) return taps;
  taps.cells = clamp(max(x, y) / max(min(x, y), 1.0), 1.0, maxTaps);
  taps.level = clamp(log2(max(x, y) / taps.cells), 0.0, log2(size));
  if (taps.cells <= 1.25) return taps;
  taps.pairs = int(ceil(0.5 * taps.cells));
  taps.spacing = taps.pairs == 1 ? 0.5 * (taps.cells - 1.25) / 0.75 : 1.0 / taps.cells;
  return taps;
}

int tapCount(Taps taps) {
  return max(2 * taps.pairs, 1);
}

// Where a tap reads, and its share of the lookup.
vec3 tapDirection(Taps taps, vec3 lookup, int tap, out float share) {
  share = 1.0;
  if (taps.pairs == 0) return lookup;
  int pair = tap >> 1;
  bool outermost = pair + 1 == taps.pairs;
  share = (outermost ? 0.5 * taps.cells - float(pair) : 1.0) / taps.cells;
  // The outermost of several pairs takes the middles of what the others leave.
  float offset = outermost && pair > 0 ? 0.5 * (float(pair) / taps.cells + 0.5) : (float(pair) + 0.5) * taps.spacing;
  return lookup + ((tap & 1) == 0 ? offset : -offset) * taps.longer;
}

// Shells front to back: call with the light and the transmittance so far, which begin with 0 and 1.
void addShell(vec4 shell, inout vec3 light, inout float transmittance) {
  light += transmittance * shell.rgb;
  transmittance *= 1.0 - shell.a;
}

// Fresnel reflectance; c = dot(n, v).
vec3 fresnelSchlick(float c, vec3 r0) {
  return r0 + (1.0 - r0) * pow(1.0 - clamp(c, 0.0, 1.0), 5.0);
}

vec3 fresnelDielectric(float c, vec3 ior) {
  c = clamp(c, 0.0, 1.0);
  vec3 k = (ior - 1.0) * (ior + 1.0);
  vec3 g = sqrt(max(k + c * c, 0.0));
  vec3 s = g + c;
  vec3 r = k / max(s * s, 1e-20);
  vec3 q = (c * s - 1.0) / (c * (g - c) + 1.0);
  vec3 f = 0.5 * r * r * (1.0 + q * q);
  return mix(min(f, 1.0), vec3(1.0), vec3(lessThan(k + c * c, vec3(0.0))));  // total reflection
}

vec3 fresnelConductor(float c, vec3 eta, vec3 k) {
  c = clamp(c, 0.0, 1.0);
  float c2 = c * c;
  float s2 = 1.0 - c2;
  vec3 e = eta * eta - k * k - s2;
  vec3 ab = sqrt(e * e + 4.0 * eta * eta * k * k);
  vec3 a = sqrt(max(0.5 * (ab + e), 0.0));
  vec3 perpendicular = (ab + c2 - 2.0 * a * c) / (ab + c2 + 2.0 * a * c);
  vec3 ratio = (c2 * ab + s2 * s2 - 2.0 * a * c * s2) / (c2 * ab + s2 * s2 + 2.0 * a * c * s2);
  return 0.5 * perpendicular * (1.0 + ratio);
}
