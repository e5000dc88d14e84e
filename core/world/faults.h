// Faults: the list of faults of a scene. It keeps the first kMostFaults in words and counts the rest.
//
// A check names a place (`At`: a body, a joint) and a field in it, and returns whether all is well:
//
//   faults.At("bodies[12] (id 40 \"crate\")");
//   faults.Positive("mass", body.mass(), kMinMass_kg, kMaxMass_kg);
//
// For use inside core/world only. Thread rule: one thread.
#pragma once

#include <string>
#include <vector>

#include "absl/status/status.h"
#include "core/world/math.h"
#include "tessera/v1/scene.pb.h"

namespace tessera {

class Faults {
 public:
  explicit Faults(std::string file) : file_(std::move(file)) {}

  // Names the place of the faults that follow; empty: the scene as a whole.
  void At(std::string place) { place_ = std::move(place); }
  void Add(const std::string& field_and_problem);
  std::size_t count() const { return count_; }
  // OK, or INVALID_ARGUMENT.
  absl::Status ToStatus() const;

  // Each adds a fault and returns false unless the value is finite and within [low, high].
  bool Range(const std::string& field, double value, double low, double high);
  bool Positive(const std::string& field, double value, double low, double high);  // asks for "> 0" first
  bool NotNegative(const std::string& field, double value, double high);           // asks for ">= 0" first
  bool Vector(const std::string& field, const v1::Vec3& v, double limit);          // each component within +-limit
  bool Length(const std::string& field, const v1::Vec3& v, double limit);          // finite and no longer than
  bool Volume(const std::string& field, const v1::Box& box);                       // min < max, within kMaxCoordinate_m
  bool Name(const std::string& field, const std::string& name);                    // short and printable; may be empty

  // Checks a pose and returns it with its quaternion normalised; the identity if it is wrong.
  Pose Normalised(const std::string& field, const v1::Pose& pose, double position_limit_m);

 private:
  bool Finite(const std::string& field, double value);

  // So many, of so many bytes at most, are one line that a gRPC status carries, whose metadata are 8 KB at most; and a
  // scene that has more has one fault many times.
  static constexpr std::size_t kMostFaults = 20, kMostFaultBytes = 300;

  std::string file_, place_;
  std::vector<std::string> texts_;
  std::size_t count_ = 0;
};

}  // namespace tessera
