/// The projections in which maps are kept: for each, what the page has to know of it. The library's own are in
/// cpp/src/envmap/map_kinds.hpp.

type Vector = [number, number, number];

// OpenGL 4.6 core profile, table 8.19: the axis of each face, and those along which s and t grow.
const FACES: [Vector, Vector, Vector][] = [
  [
    [1, 0, 0],
    [0, 0, -1],
    [0, -1, 0],
  ],
  [
    [-1, 0, 0],
    [0, 0, 1],
    [0, -1, 0],
  ],
  [
    [0, 1, 0],
    [1, 0, 0],
    [0, 0, 1],
  ],
  [
    [0, -1, 0],
    [1, 0, 0],
    [0, 0, -1],
  ],
  [
    [0, 0, 1],
    [1, 0, 0],
    [0, -1, 0],
  ],
  [
    [0, 0, -1],
    [-1, 0, 0],
    [0, -1, 0],
  ],
];

/// The texel of a neighbouring face that lies across the edge from a place one outside of a face: its number
/// (face · n + row) · n + column.
export function texelAcrossEdge(n: number, face: number, row: number, column: number): number {
  const [major, sAxis, tAxis] = FACES[face];
  const s = (2 * (column + 0.5)) / n - 1;
  const t = (2 * (row + 0.5)) / n - 1;
  const d = major.map((m, i) => m + s * sAxis[i] + t * tAxis[i]) as Vector;
  const a = d.map(Math.abs);
  const axis = a[0] >= a[1] && a[0] >= a[2] ? 0 : a[1] >= a[2] ? 1 : 2;
  const other = 2 * axis + (d[axis] < 0 ? 1 : 0);
  const along = (direction: Vector) =>
    (direction[0] * d[0] + direction[1] * d[1] + direction[2] * d[2]) / a[axis];
  const texel = (x: number) => Math.min(Math.max(Math.floor((0.5 + 0.5 * x) * n), 0), n - 1);
  return (other * n + texel(along(FACES[other][2]))) * n + texel(along(FACES[other][1]));
}

const CUBE = `FacePoint facePoint(vec3 d) {
  vec3 a = abs(d);
  if (a.x >= a.y && a.x >= a.z) {
    vec2 st = vec2(d.x > 0.0 ? -d.z : d.z, -d.y) / max(a.x, 1e-30);
    return FacePoint(d.x < 0.0 ? 1.0 : 0.0, 0.5 + 0.5 * st);
  }
  if (a.y >= a.z) {
    vec2 st = vec2(d.x, d.y > 0.0 ? d.z : -d.z) / a.y;
    return FacePoint(d.y < 0.0 ? 3.0 : 2.0, 0.5 + 0.5 * st);
  }
  vec2 st = vec2(d.z > 0.0 ? d.x : -d.x, -d.y) / a.z;
  return FacePoint(d.z < 0.0 ? 5.0 : 4.0, 0.5 + 0.5 * st);
}

float faceLength(vec3 d, vec3 change) {
  vec3 a = abs(d);
  float major;
  vec3 onFace;
  if (a.x >= a.y && a.x >= a.z) {
    onFace = change - d * (change.x / d.x);
    major = a.x;
    onFace.x = 0.0;
  } else if (a.y >= a.z) {
    onFace = change - d * (change.y / d.y);
    major = a.y;
    onFace.y = 0.0;
  } else {
    onFace = change - d * (change.z / d.z);
    major = a.z;
    onFace.z = 0.0;
  }
  return 0.5 * length(onFace) / max(major, 1e-30);
}
`;

const PARABOLOID = `// The front map, around +Z, is face 0, the back map face 1.
FacePoint facePoint(vec3 d) {
  float size = max(length(d) + abs(d.z), 1e-30);
  return FacePoint(d.z >= 0.0 ? 0.0 : 1.0, 0.5 + 0.5 * vec2(d.x, -d.y) / size);
}

// Length of the derivative of (x, y) / (|d| + |z|), in faces.
float faceLength(vec3 d, vec3 change) {
  float range = max(length(d), 1e-30);
  float size = range + abs(d.z);
  float growth = dot(d, change) / range + (d.z < 0.0 ? -change.z : change.z);
  return 0.5 * length(change.xy - d.xy * (growth / size)) / size;
}
`;

interface MapProjection {
  faces: number;
  /// Faces of a level in a row of the received atlas.
  across: number;
  /// Number of the texel across the edge from a place one outside of a face; null where nothing lies beyond, so that the last
  /// texels are repeated.
  acrossEdge: ((n: number, face: number, row: number, column: number) => number) | null;
  /// Where a direction falls: FacePoint facePoint(vec3 d), and how long a change of it is there, in faces: float
  /// faceLength(vec3 d, vec3 change).
  glsl: string;
}

function mapProjection(projection: MapProjection): MapProjection {
  return projection;
}

export const PROJECTIONS = {
  cube: mapProjection({ faces: 6, across: 3, acrossEdge: texelAcrossEdge, glsl: CUBE }),
  paraboloid: mapProjection({ faces: 2, across: 2, acrossEdge: null, glsl: PARABOLOID }),
};

export type Projection = keyof typeof PROJECTIONS;
