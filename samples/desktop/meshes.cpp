#include "meshes.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>
#include <vector>

namespace desktop {
namespace {

constexpr float kPi = 3.14159265F;
constexpr int kAround = 16, kRings = 4;  // segments about the axis; rings of a hemisphere

void Triangle(Mesh& mesh, Vec3 a, Vec3 b, Vec3 c) {
  const Vec3 normal = Unit(Cross(b - a, c - a));
  for (const Vec3 corner : {a, b, c}) mesh.push_back({corner, normal});
}

void Quad(Mesh& mesh, Vec3 a, Vec3 b, Vec3 c, Vec3 d) {
  Triangle(mesh, a, b, c);
  Triangle(mesh, a, c, d);
}

Mesh Box(Vec3 h) {
  Mesh mesh;
  for (int axis = 0; axis < 3; ++axis) {
    for (const float side : {-1.0F, 1.0F}) {
      const auto corner = [&](float u, float v) {
        std::array<float, 3> at{};
        at[static_cast<std::size_t>(axis)] = side;
        at[static_cast<std::size_t>((axis + 1) % 3)] = u * side;
        at[static_cast<std::size_t>((axis + 2) % 3)] = v;
        return Vec3{at[0] * h.x, at[1] * h.y, at[2] * h.z};
      };
      Quad(mesh, corner(-1, -1), corner(1, -1), corner(1, 1), corner(-1, 1));
    }
  }
  return mesh;
}

// A point of the outline of a body of revolution: distance from the axis, height, and the normal in that plane.
struct Outline {
  float radius, height, out, up;
};

// Turns an outline, from the bottom to the top, about y.
Mesh Revolve(const std::vector<Outline>& outline) {
  Mesh mesh;
  const auto at = [](const Outline& o, int step) {
    const float angle = 2 * kPi * static_cast<float>(step % kAround) / kAround;
    const float c = std::cos(angle), s = std::sin(angle);
    return Vertex{{o.radius * c, o.height, -o.radius * s}, {o.out * c, o.up, -o.out * s}};
  };
  for (std::size_t i = 0; i + 1 < outline.size(); ++i) {
    if (outline[i].radius == outline[i + 1].radius && outline[i].height == outline[i + 1].height) continue;  // an edge
    for (int step = 0; step < kAround; ++step) {
      const Vertex a = at(outline[i], step), b = at(outline[i], step + 1);
      const Vertex c = at(outline[i + 1], step + 1), d = at(outline[i + 1], step);
      if (outline[i].radius > 0) mesh.insert(mesh.end(), {a, b, c});
      if (outline[i + 1].radius > 0) mesh.insert(mesh.end(), {a, c, d});
    }
  }
  return mesh;
}

std::vector<Outline> CapsuleOutline(float radius, float half) {
  std::vector<Outline> outline;
  for (int ring = -kRings; ring <= kRings; ++ring) {
    const float angle = kPi / 2 * static_cast<float>(ring) / kRings;
    const float c = std::abs(ring) == kRings ? 0 : std::cos(angle), s = std::sin(angle);
    if (ring == 0 && half > 0) outline.push_back({radius, -half, 1, 0});
    outline.push_back({radius * c, radius * s + (ring < 0 ? -half : half), c, s});
  }
  return outline;
}

Mesh Cylinder(float radius, float half) {
  return Revolve({{0, -half, 0, -1},
                  {radius, -half, 0, -1},
                  {radius, -half, 1, 0},
                  {radius, half, 1, 0},
                  {radius, half, 0, 1},
                  {0, half, 0, 1}});
}

Mesh Cone(float radius, float height) {
  const float slant = std::hypot(radius, height), out = height / slant, up = radius / slant;
  return Revolve({{0, -height / 2, 0, -1},
                  {radius, -height / 2, 0, -1},
                  {radius, -height / 2, out, up},
                  {0, height / 2, out, up}});
}

Vec3 PointAt(const float* xyz, std::size_t index) { return {xyz[3 * index], xyz[3 * index + 1], xyz[3 * index + 2]}; }

Mesh TrianglesOf(const tessera::ShapeInfo& shape) {
  Mesh mesh;
  mesh.reserve(shape.index_count);
  for (std::size_t i = 0; i + 2 < shape.index_count; i += 3) {
    const std::uint32_t* at = shape.indices + i;
    if (std::max({at[0], at[1], at[2]}) >= shape.vertex_count) continue;
    Triangle(mesh, PointAt(shape.vertices, at[0]), PointAt(shape.vertices, at[1]), PointAt(shape.vertices, at[2]));
  }
  return mesh;
}

Mesh HeightField(const tessera::ShapeInfo& shape) {
  Mesh mesh;
  const std::size_t columns = shape.columns, rows = shape.rows;
  if (shape.vertex_count < columns * rows) return mesh;
  const auto at = [&](std::size_t column, std::size_t row) {
    const auto from_middle = [&](std::size_t index, std::size_t count) {
      return static_cast<float>((static_cast<double>(index) - static_cast<double>(count - 1) / 2) * shape.spacing);
    };
    return Vec3{from_middle(column, columns), shape.vertices[row * columns + column], from_middle(row, rows)};
  };
  for (std::size_t row = 0; row + 1 < rows; ++row) {
    for (std::size_t column = 0; column + 1 < columns; ++column) {
      Quad(mesh, at(column, row), at(column, row + 1), at(column + 1, row + 1), at(column + 1, row));
    }
  }
  return mesh;
}

Mesh Plane(Vec3 normal, float offset, float half) {
  const Vec3 n = Unit(normal);
  const Vec3 u = Unit(Cross(n, std::abs(n.y) > 0.9F ? Vec3{0, 0, 1} : Vec3{0, 1, 0})), v = Cross(n, u);
  const Vec3 middle = n * offset;
  const auto corner = [&](float a, float b) { return middle + u * (a * half) + v * (b * half); };
  Mesh mesh;
  Quad(mesh, corner(-1, -1), corner(1, -1), corner(1, 1), corner(-1, 1));
  return mesh;
}

struct Face {
  std::size_t a, b, c;
};

// Four points that span a volume, as faces that look outwards; empty where there are none.
std::vector<Face> FirstFaces(const std::vector<Vec3>& p, float least) {
  std::size_t far = 0, off = 0, high = 0;
  const auto furthest = [&](std::size_t& best, auto distance) {
    for (std::size_t i = 0; i < p.size(); ++i) best = distance(p[i]) > distance(p[best]) ? i : best;
    return distance(p[best]) > least;
  };
  if (!furthest(far, [&](Vec3 q) { return Length(q - p[0]); })) return {};
  const Vec3 along = Unit(p[far] - p[0]);
  if (!furthest(off, [&](Vec3 q) { return Length(Cross(q - p[0], along)); })) return {};
  const Vec3 normal = Unit(Cross(p[far] - p[0], p[off] - p[0]));
  if (!furthest(high, [&](Vec3 q) { return std::abs(Dot(q - p[0], normal)); })) return {};
  if (Dot(p[high] - p[0], normal) > 0) std::swap(far, off);
  return {{0, far, off}, {0, off, high}, {off, far, high}, {far, 0, high}};
}

}  // namespace

Mesh ConvexHull(const float* points, std::size_t count) {
  std::vector<Vec3> p;
  p.reserve(count);
  float extent = 0;
  for (std::size_t i = 0; i < count; ++i) {
    p.push_back(PointAt(points, i));
    extent = std::max(extent, Length(p[i] - p[0]));
  }
  const float least = 1e-4F * extent;
  std::vector<Face> faces = p.empty() ? std::vector<Face>() : FirstFaces(p, least);
  // Each point takes away the faces that it sees and closes the hole by faces of its own.
  for (std::size_t i = 0; i < p.size() && !faces.empty(); ++i) {
    std::vector<std::pair<std::size_t, std::size_t>> edges;
    std::vector<Face> kept;
    for (const Face& face : faces) {
      const Vec3 normal = Unit(Cross(p[face.b] - p[face.a], p[face.c] - p[face.a]));
      if (Dot(p[i] - p[face.a], normal) <= least) {
        kept.push_back(face);
      } else {
        for (const auto& edge : {std::pair(face.a, face.b), std::pair(face.b, face.c), std::pair(face.c, face.a)}) {
          edges.push_back(edge);
        }
      }
    }
    for (const auto& [from, to] : edges) {
      if (std::find(edges.begin(), edges.end(), std::pair(to, from)) == edges.end()) kept.push_back({from, to, i});
    }
    faces = std::move(kept);
  }
  Mesh mesh;
  for (const Face& face : faces) Triangle(mesh, p[face.a], p[face.b], p[face.c]);
  return mesh;
}

Mesh MeshOf(const tessera::ShapeInfo& shape, float plane_half_m) {
  const auto d = [&](std::size_t i) { return static_cast<float>(shape.dimensions[i]); };
  switch (shape.kind) {
    case TESSERA_SHAPE_BOX:
      return Box({d(0), d(1), d(2)});
    case TESSERA_SHAPE_SPHERE:
      return Revolve(CapsuleOutline(d(0), 0));
    case TESSERA_SHAPE_CAPSULE:
      return Revolve(CapsuleOutline(d(0), d(1)));
    case TESSERA_SHAPE_CYLINDER:
      return Cylinder(d(0), d(1));
    case TESSERA_SHAPE_CONE:
      return Cone(d(0), d(1));
    case TESSERA_SHAPE_CONVEX_HULL:
      return ConvexHull(shape.vertices, shape.vertex_count);
    case TESSERA_SHAPE_MESH:
      return TrianglesOf(shape);
    case TESSERA_SHAPE_HEIGHT_FIELD:
      return HeightField(shape);
    case TESSERA_SHAPE_PLANE:
      return Plane({d(0), d(1), d(2)}, d(3), plane_half_m);
    default:
      return {};
  }
}

std::array<double, 4> Multiply(const std::array<double, 4>& a, const std::array<double, 4>& b) {
  return {a[3] * b[0] + a[0] * b[3] + a[1] * b[2] - a[2] * b[1], a[3] * b[1] - a[0] * b[2] + a[1] * b[3] + a[2] * b[0],
          a[3] * b[2] + a[0] * b[1] - a[1] * b[0] + a[2] * b[3], a[3] * b[3] - a[0] * b[0] - a[1] * b[1] - a[2] * b[2]};
}

std::array<double, 3> Rotate(const std::array<double, 4>& q, const std::array<double, 3>& v) {
  const std::array<double, 4> turned = Multiply(Multiply(q, {v[0], v[1], v[2], 0}), {-q[0], -q[1], -q[2], q[3]});
  return {turned[0], turned[1], turned[2]};
}

std::vector<Part> PartsOf(const tessera_shape* shape) {
  std::vector<Part> whole = {Part{shape}}, parts;
  while (!whole.empty()) {
    const Part part = whole.back();
    whole.pop_back();
    tessera::ShapeInfo info = TESSERA_SHAPE_INFO;
    if (tessera_get_shape(part.shape, &info) != TESSERA_OK) continue;
    if (info.kind != TESSERA_SHAPE_COMPOUND) {
      parts.push_back(part);
      continue;
    }
    for (std::size_t i = 0; i < info.child_count; ++i) {
      Part child;
      tessera_shape_child(part.shape, i, &child.shape, child.position.data(), child.orientation.data());
      const std::array<double, 3> moved = Rotate(part.orientation, child.position);
      for (std::size_t axis = 0; axis < 3; ++axis) child.position[axis] = part.position[axis] + moved[axis];
      child.orientation = Multiply(part.orientation, child.orientation);
      whole.push_back(child);
    }
  }
  return parts;
}

}  // namespace desktop
