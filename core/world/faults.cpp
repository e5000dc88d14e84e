#include "core/world/faults.h"

#include <algorithm>
#include <cmath>

#include "absl/strings/escaping.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "core/world/limits.h"
#include "core/world/proto_math.h"

namespace tessera {

void Faults::Add(const std::string& field_and_problem) {
  if (++count_ > kMostFaults) return;
  texts_.push_back(absl::StrCat(place_, place_.empty() ? "" : ": ", field_and_problem));
  if (texts_.back().size() > kMostFaultBytes) texts_.back().resize(kMostFaultBytes);
}

absl::Status Faults::ToStatus() const {
  if (count_ == 0) return absl::OkStatus();
  return absl::InvalidArgumentError(
      absl::StrCat(file_, ": ", absl::StrJoin(texts_, "; "),
                   count_ > kMostFaults ? absl::StrCat(" (and ", count_ - kMostFaults, " more)") : ""));
}

bool Faults::Finite(const std::string& field, double value) {
  if (std::isfinite(value)) return true;
  Add(absl::StrCat(field, " must be a finite number, got ", std::isnan(value) ? "nan" : value > 0 ? "inf" : "-inf"));
  return false;
}

bool Faults::Range(const std::string& field, double value, double low, double high) {
  if (!Finite(field, value)) return false;
  if (value >= low && value <= high) return true;
  Add(absl::StrCat(field, " must be ", low, " to ", high, ", got ", value));
  return false;
}

bool Faults::Positive(const std::string& field, double value, double low, double high) {
  if (!Finite(field, value)) return false;
  if (value > 0) return Range(field, value, low, high);
  Add(absl::StrCat(field, " must be > 0, got ", value));
  return false;
}

bool Faults::NotNegative(const std::string& field, double value, double high) {
  if (!Finite(field, value)) return false;
  if (value >= 0) return Range(field, value, 0, high);
  Add(absl::StrCat(field, " must be >= 0, got ", value));
  return false;
}

bool Faults::Vector(const std::string& field, const v1::Vec3& v, double limit) {
  const auto within = [limit](double value) { return value >= -limit && value <= limit; };
  if (within(v.x()) && within(v.y()) && within(v.z())) return true;  // a mesh need not name all components
  const bool x = Range(field + ".x", v.x(), -limit, limit);
  const bool y = Range(field + ".y", v.y(), -limit, limit);
  return Range(field + ".z", v.z(), -limit, limit) && x && y;
}

bool Faults::Length(const std::string& field, const v1::Vec3& v, double limit) {
  const bool finite = Finite(field + ".x", v.x()) && Finite(field + ".y", v.y()) && Finite(field + ".z", v.z());
  if (!finite) return false;
  const double length = std::hypot(v.x(), v.y(), v.z());
  if (length <= limit) return true;
  Add(absl::StrCat(field, " must be at most ", limit, " long, got ", length));
  return false;
}

bool Faults::Volume(const std::string& field, const v1::Box& box) {
  const bool min = Vector(field + ".min", box.min(), kMaxCoordinate_m);
  if (!Vector(field + ".max", box.max(), kMaxCoordinate_m) || !min) return false;
  const auto axis = [&](const char* name, double low, double high) {
    if (low < high) return true;
    Add(absl::StrCat(field, " has no volume: min.", name, " is ", low, ", max.", name, " is ", high));
    return false;
  };
  return axis("x", box.min().x(), box.max().x()) && axis("y", box.min().y(), box.max().y()) &&
         axis("z", box.min().z(), box.max().z());
}

bool Faults::Name(const std::string& field, const std::string& name) {
  const bool printable = std::ranges::none_of(
      name, [](char c) { return static_cast<unsigned char>(c) < 0x20 || c == 0x7f || c == '"' || c == '\\'; });
  if (printable && name.size() <= kMaxNameLength) return true;
  Add(absl::StrCat(field, " must be at most ", kMaxNameLength,
                   " bytes without control characters, quotes and backslashes, got \"",
                   absl::Utf8SafeCEscape(name.substr(0, kMaxNameLength)), "\""));
  return false;
}

Pose Faults::Normalised(const std::string& field, const v1::Pose& pose, double position_limit_m) {
  if (!Vector(field + ".position", pose.position(), position_limit_m)) return {};
  const Quatd q = FromProto(pose.orientation());
  const double length = tessera::Length(q);
  if (std::abs(length - 1) <= kUnitTolerance) return {FromProto(pose.position()), tessera::Normalized(q)};
  Add(absl::StrCat(field, ".orientation must have length 1, got ", length));
  return {};
}

}  // namespace tessera
