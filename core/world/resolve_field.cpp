#include "core/world/resolve_field.h"

#include "absl/strings/str_cat.h"
#include "core/world/limits.h"
#include "core/world/proto_math.h"

namespace tessera {
namespace {

VortexField Vortex(Faults& faults, const v1::Field::Vortex& in, double most_gain_per_s) {
  faults.Vector("vortex.center", in.center(), kMaxCoordinate_m);
  faults.Positive("vortex.radius", in.radius(), kMinExtent_m, kMaxCoordinate_m);
  const double turn = in.angular_velocity();
  if (faults.Range("vortex.angular_velocity", turn, -kMaxAngularSpeed_rad_s, kMaxAngularSpeed_rad_s)) {
    faults.Range("vortex.angular_velocity * radius", turn * in.radius(), -kMaxSpeed_m_s, kMaxSpeed_m_s);
  }
  faults.NotNegative("vortex.gain", in.gain(), most_gain_per_s);
  return {FromProto(in.center()), in.radius(), turn, in.gain()};
}

UniformField Uniform(Faults& faults, const v1::Field::Uniform& in) {
  faults.Volume("uniform.bounds", in.bounds());
  faults.Length("uniform.acceleration", in.acceleration(), kMaxAcceleration_m_s2);
  return {FromProto(in.bounds()), FromProto(in.acceleration())};
}

bool Overlap(const VortexField& a, const VortexField& b) {
  return std::hypot(a.center.x - b.center.x, a.center.z - b.center.z) <= a.radius_m + b.radius_m;
}
bool Overlap(const UniformField& a, const UniformField& b) { return a.bounds.Overlaps(b.bounds); }

double StrengthOf(const VortexField& field) { return field.gain_per_s; }
double StrengthOf(const UniformField& field) { return Length(field.acceleration_m_s2); }

// The total over the field and those of its kind that overlap it.
template <class Kind>
double SumAt(const Kind& field, const std::vector<Field>& fields) {
  double sum = 0;
  for (const Field& other : fields) {
    const Kind* same = std::get_if<Kind>(&other);
    if (same != nullptr && Overlap(field, *same)) sum += StrengthOf(*same);
  }
  return sum;
}

template <class Kind>
void CheckSum(Faults& faults, const char* what, const Field& field, const std::vector<Field>& fields, double most) {
  const Kind* kind = std::get_if<Kind>(&field);
  const double sum = kind == nullptr ? 0 : SumAt(*kind, fields);
  if (sum <= most) return;
  faults.Add(absl::StrCat(what, ", with that of the fields which overlap it, must be at most ", most, ", got ", sum));
}

}  // namespace

std::vector<Field> ResolveFields(Faults& faults, const v1::Scene& scene, std::uint32_t tick_rate_hz) {
  std::vector<Field> fields;
  // A larger gain overshoots within one tick and shakes bodies apart.
  const double most_gain_per_s = tick_rate_hz;
  const std::size_t before = faults.count();
  const auto at = [&](int index) { faults.At(absl::StrCat("fields[", index, "]")); };
  for (int i = 0; i < scene.fields_size(); ++i) {
    const v1::Field& in = scene.fields(i);
    at(i);
    if (in.has_vortex()) {
      fields.emplace_back(Vortex(faults, in.vortex(), most_gain_per_s));
    } else if (in.has_uniform()) {
      fields.emplace_back(Uniform(faults, in.uniform()));
    } else {
      faults.Add("its kind is missing: give one of vortex, uniform");
    }
  }
  if (faults.count() != before) return fields;
  for (std::size_t i = 0; i < fields.size(); ++i) {
    at(static_cast<int>(i));
    CheckSum<VortexField>(faults, "vortex.gain", fields[i], fields, most_gain_per_s);
    CheckSum<UniformField>(faults, "uniform.acceleration", fields[i], fields, kMaxAcceleration_m_s2);
  }
  return fields;
}

}  // namespace tessera
