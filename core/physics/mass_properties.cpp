#include "core/physics/mass_properties.h"

#include <LinearMath/btConvexHullComputer.h>

#include <array>
#include <cmath>
#include <numbers>
#include <utility>

#include "core/physics/linear.h"
#include "core/physics/tuning.h"

namespace tessera::physics {
namespace {

constexpr double kPi = std::numbers::pi;

using Matrix = std::array<std::array<double, 3>, 3>;

// Volume, first and second moments of a solid of density 1 about its coordinates' origin; they add.
struct Moments {
  double volume = 0;
  Vec3d first;
  Matrix second{};  // integral of x x^T

  void Add(const Moments& o) {
    volume += o.volume;
    first += o.first;
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 3; ++j) second[i][j] += o.second[i][j];
  }
};

Matrix MatrixOf(Quatd q) {
  const auto x = ArrayOf(Rotate(q, {1, 0, 0})), y = ArrayOf(Rotate(q, {0, 1, 0})), z = ArrayOf(Rotate(q, {0, 0, 1}));
  Matrix m;
  for (int i = 0; i < 3; ++i) m[i] = {x[i], y[i], z[i]};
  return m;
}

// Inertia of a moment's solid about its centre of mass, for 1 kg.
Matrix InertiaAboutCenter(const Moments& m, Vec3d center) {
  const auto c = ArrayOf(center);
  Matrix covariance;
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) covariance[i][j] = m.second[i][j] / m.volume - c[i] * c[j];
  const double trace = covariance[0][0] + covariance[1][1] + covariance[2][2];
  Matrix inertia;
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) inertia[i][j] = (i == j ? trace : 0) - covariance[i][j];
  return inertia;
}

Quatd QuaternionOf(const Matrix& r) {
  // The largest of the four squares keeps the division away from zero.
  const double t[4] = {1 + r[0][0] - r[1][1] - r[2][2], 1 - r[0][0] + r[1][1] - r[2][2],
                       1 - r[0][0] - r[1][1] + r[2][2], 1 + r[0][0] + r[1][1] + r[2][2]};
  int k = 0;
  for (int i = 1; i < 4; ++i)
    if (t[i] > t[k]) k = i;
  const double x = r[2][1] - r[1][2], y = r[0][2] - r[2][0], z = r[1][0] - r[0][1];
  const double xy = r[0][1] + r[1][0], xz = r[0][2] + r[2][0], yz = r[1][2] + r[2][1];
  const Quatd forms[4] = {{t[0], xy, xz, x}, {xy, t[1], yz, y}, {xz, yz, t[2], z}, {x, y, z, t[3]}};
  return Normalized(forms[k]);
}

// Eigenvalues and eigenvectors (columns of `axes`) of a symmetric matrix by Jacobi's rotations.
Vec3d Diagonalize(Matrix a, Matrix* axes) {
  *axes = {{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}};
  constexpr int kSweeps = 32;  // convergence is quadratic; about 6 reach the last bit
  for (int sweep = 0; sweep < kSweeps; ++sweep) {
    for (const auto& [p, q] : {std::pair{0, 1}, std::pair{0, 2}, std::pair{1, 2}}) {
      if (a[p][q] == 0) continue;
      const double theta = (a[q][q] - a[p][p]) / (2 * a[p][q]);
      const double t = (theta >= 0 ? 1 : -1) / (std::abs(theta) + std::sqrt(theta * theta + 1));
      const double c = 1 / std::sqrt(t * t + 1), s = t * c;
      for (int k = 0; k < 3; ++k) {
        const double kp = a[k][p], kq = a[k][q];
        a[k][p] = c * kp - s * kq;
        a[k][q] = s * kp + c * kq;
      }
      for (int k = 0; k < 3; ++k) {
        const double pk = a[p][k], qk = a[q][k];
        a[p][k] = c * pk - s * qk;
        a[q][k] = s * pk + c * qk;
        const double kp = (*axes)[k][p], kq = (*axes)[k][q];
        (*axes)[k][p] = c * kp - s * kq;
        (*axes)[k][q] = s * kp + c * kq;
      }
    }
  }
  return {a[0][0], a[1][1], a[2][2]};
}

MassProperties FromMoments(const Moments& m) {
  MassProperties result{.volume_m3 = m.volume, .center_of_mass = m.first / m.volume, .principal = {}, .axes = {}};
  const Matrix inertia = InertiaAboutCenter(m, result.center_of_mass);
  const double trace = inertia[0][0] + inertia[1][1] + inertia[2][2];
  const double off = std::abs(inertia[0][1]) + std::abs(inertia[0][2]) + std::abs(inertia[1][2]);
  if (off <= kSymmetryTolerance * trace) {
    result.principal = {inertia[0][0], inertia[1][1], inertia[2][2]};
    return result;
  }
  Matrix axes;
  result.principal = Diagonalize(inertia, &axes);
  const double determinant = axes[0][0] * (axes[1][1] * axes[2][2] - axes[1][2] * axes[2][1]) -
                             axes[0][1] * (axes[1][0] * axes[2][2] - axes[1][2] * axes[2][0]) +
                             axes[0][2] * (axes[1][0] * axes[2][1] - axes[1][1] * axes[2][0]);
  if (determinant < 0)
    for (auto& row : axes) row[2] = -row[2];
  result.axes = QuaternionOf(axes);
  return result;
}

// Moments of a solid given by its mass properties, posed.
Moments MomentsOf(const MassProperties& part, const Pose& pose) {
  const Quatd orientation = Normalized(pose.orientation);
  const Vec3d center = pose.position + Rotate(orientation, part.center_of_mass);
  const Matrix r = MatrixOf(orientation * part.axes);
  const auto inertia = ArrayOf(part.principal), c = ArrayOf(center);
  const double half_trace = (inertia[0] + inertia[1] + inertia[2]) / 2;
  Moments m{.volume = part.volume_m3, .first = center * part.volume_m3, .second = {}};
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) {
      double covariance = c[i] * c[j];
      for (int k = 0; k < 3; ++k) covariance += r[i][k] * (half_trace - inertia[k]) * r[j][k];
      m.second[i][j] = part.volume_m3 * covariance;
    }
  return m;
}

// The tetrahedron of three points and the origin; negative where the points turn clockwise seen from outside.
Moments Tetrahedron(Vec3d a, Vec3d b, Vec3d c) {
  const double det = Dot(a, Cross(b, c));
  const Vec3d sum = a + b + c;
  Moments m{.volume = det / 6, .first = sum * (det / 24), .second = {}};
  const auto pa = ArrayOf(a), pb = ArrayOf(b), pc = ArrayOf(c), ps = ArrayOf(sum);
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j)
      m.second[i][j] = det / 120 * (pa[i] * pa[j] + pb[i] * pb[j] + pc[i] * pc[j] + ps[i] * ps[j]);
  return m;
}

MassProperties Of(const BoxShape& box) {
  const Vec3d h = box.half_extents_m;
  return {.volume_m3 = 8 * h.x * h.y * h.z,
          .center_of_mass = {},
          .principal = Vec3d{h.y * h.y + h.z * h.z, h.x * h.x + h.z * h.z, h.x * h.x + h.y * h.y} / 3,
          .axes = {}};
}

MassProperties Of(const SphereShape& sphere) {
  const double r = sphere.radius_m, i = 0.4 * r * r;
  return {.volume_m3 = 4.0 / 3 * kPi * r * r * r, .center_of_mass = {}, .principal = {i, i, i}, .axes = {}};
}

MassProperties Of(const CylinderShape& cylinder) {
  const double r2 = cylinder.radius_m * cylinder.radius_m, h = cylinder.half_height_m;
  const double across = r2 / 4 + h * h / 3;
  return {.volume_m3 = 2 * kPi * r2 * h, .center_of_mass = {}, .principal = {across, r2 / 2, across}, .axes = {}};
}

// A cylinder and two half balls, whose own centres lie 3/8 r from their flat sides.
MassProperties Of(const CapsuleShape& capsule) {
  const double r = capsule.radius_m, h = capsule.half_height_m;
  const MassProperties middle = Of(CylinderShape{r, h}), ends = Of(SphereShape{r});
  const double volume = middle.volume_m3 + ends.volume_m3;
  const double m = middle.volume_m3 / volume, e = ends.volume_m3 / volume;
  const double across = m * middle.principal.x + e * (ends.principal.x + h * h + 0.75 * r * h);
  const double along = m * middle.principal.y + e * ends.principal.y;
  return {.volume_m3 = volume, .center_of_mass = {}, .principal = {across, along, across}, .axes = {}};
}

MassProperties Of(const ConeShape& cone) {
  const double r2 = cone.radius_m * cone.radius_m, h = cone.height_m;
  const double across = 0.15 * r2 + 0.0375 * h * h;
  return {.volume_m3 = kPi * r2 * h / 3,
          .center_of_mass = {0, -h / 4, 0},
          .principal = {across, 0.3 * r2, across},
          .axes = {}};
}

MassProperties Of(const ConvexHullShape& hull) {
  btConvexHullComputer computer;
  computer.compute(&hull.points[0].x, sizeof(Vec3f), static_cast<int>(hull.points.size()), 0, 0);
  Vec3d inside;
  const auto vertex = [&](int i) {
    const btVector3& v = computer.vertices[i];
    return Vec3d{v.x(), v.y(), v.z()};
  };
  for (int i = 0; i < computer.vertices.size(); ++i) inside += vertex(i);
  inside = inside / computer.vertices.size();
  Moments total;
  for (int f = 0; f < computer.faces.size(); ++f) {
    const btConvexHullComputer::Edge* first = &computer.edges[computer.faces[f]];
    const Vec3d corner = vertex(first->getSourceVertex()) - inside;
    for (const auto* edge = first->getNextEdgeOfFace(); edge->getTargetVertex() != first->getSourceVertex();
         edge = edge->getNextEdgeOfFace()) {
      total.Add(
          Tetrahedron(corner, vertex(edge->getSourceVertex()) - inside, vertex(edge->getTargetVertex()) - inside));
    }
  }
  if (total.volume < 0) {  // faces wound the other way
    Moments mirrored{.volume = -total.volume, .first = -total.first, .second = total.second};
    for (auto& row : mirrored.second)
      for (double& x : row) x = -x;
    total = mirrored;
  }
  MassProperties result = FromMoments(total);
  result.center_of_mass += inside;
  return result;
}

MassProperties Of(const CompoundShape& compound) {
  Moments total;
  for (const CompoundChild& child : compound.children) total.Add(MomentsOf(MassPropertiesOf(*child.shape), child.pose));
  return FromMoments(total);
}

MassProperties Of(const TriangleMeshShape&) { return {}; }
MassProperties Of(const HeightFieldShape&) { return {}; }
MassProperties Of(const PlaneShape&) { return {}; }

}  // namespace

MassProperties MassPropertiesOf(const Shape& shape) {
  return std::visit([](const auto& form) { return Of(form); }, shape.form);
}

Vec3d CenterOfMass(const BodyDef& def) {
  if (def.motion == Motion::kStatic && !def.kinematic) return {};
  return MassPropertiesOf(*def.shape).center_of_mass;
}

}  // namespace tessera::physics
