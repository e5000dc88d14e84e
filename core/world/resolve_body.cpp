#include "core/world/resolve_body.h"

#include <algorithm>
#include <cmath>

#include "absl/strings/ascii.h"
#include "absl/strings/escaping.h"
#include "absl/strings/str_cat.h"
#include "core/world/limits.h"
#include "core/world/proto_math.h"
#include "core/world/resolve_path.h"

namespace tessera {
namespace {

std::string Quoted(const std::string& name) {
  return absl::StrCat("\"", absl::Utf8SafeCEscape(name.substr(0, kMaxNameLength)), "\"");
}

}  // namespace

std::string PlaceOf(int index, const v1::Body& body) {
  const std::string id = absl::StrCat("bodies[", index, "] (id ", body.id());
  return body.name().empty() ? id + ")" : absl::StrCat(id, " ", Quoted(body.name()), ")");
}

void BodyResolver::AddMaterial(int index, const v1::Material& in) {
  faults_.At(absl::StrCat("materials[", index, "]"));
  if (in.name().empty()) return faults_.Add("name is missing");
  if (!faults_.Name("name", in.name())) return;
  faults_.At(absl::StrCat("materials[", index, "] (", Quoted(in.name()), ")"));
  faults_.NotNegative("friction", in.friction(), kMaxFriction);
  faults_.NotNegative("rolling_friction", in.rolling_friction(), kMaxFriction);
  faults_.NotNegative("spinning_friction", in.spinning_friction(), kMaxFriction);
  faults_.Range("restitution", in.restitution(), 0, 1);
  const Material material{.friction = in.friction(),
                          .rolling_friction = in.rolling_friction(),
                          .spinning_friction = in.spinning_friction(),
                          .restitution = in.restitution()};
  if (!materials_.emplace(in.name(), material).second) faults_.Add("name is used twice");
}

BodyDef BodyResolver::Body(int index, const v1::Body& body) {
  faults_.At(PlaceOf(index, body));
  BodyDef def = Common(body);
  def.id = BodyId(body.id());
  if (body.id() < 1 || body.id() > kMaxSceneBody) {
    faults_.Add(absl::StrCat("id must be 1 to ", kMaxSceneBody, ", got ", body.id()));
  }
  const Pose pose = faults_.Normalised("pose", body.pose(), kMaxCoordinate_m);
  if (!bounds_.Contains(pose.position)) {
    faults_.Add(absl::StrCat("pose.position is outside the scene's bounds, got (", pose.position.x, ", ",
                             pose.position.y, ", ", pose.position.z, ")"));
  }
  def.initial.position = pose.position;
  def.initial.orientation = pose.orientation;
  if (body.kinematic().has_path()) {
    // Every region has it, and nobody owns it.
    def.motion = Motion::kStatic;
    def.path = ResolvePath(faults_, body.kinematic().path(), pose, bounds_);
  }
  return def;
}

BodyDef BodyResolver::Template(const std::string& place, const v1::Body& body) {
  faults_.At(body.name().empty() ? place : absl::StrCat(place, " (", Quoted(body.name()), ")"));
  if (body.id() != 0) faults_.Add(absl::StrCat("id must be left out of a template, got ", body.id()));
  if (body.has_pose()) faults_.Add("pose must be left out of a template");
  if (body.has_kinematic()) faults_.Add("kinematic must be left out of a template");
  return Common(body);
}

BodyDef BodyResolver::Member(const std::string& place, const v1::Body& body) {
  faults_.At(body.name().empty() ? place : absl::StrCat(place, " (", Quoted(body.name()), ")"));
  if (body.id() != 0) faults_.Add(absl::StrCat("id must be left out of a prefab, got ", body.id()));
  if (body.motion() == v1::MOTION_STATIC) faults_.Add("motion must be MOTION_DYNAMIC in a prefab");
  if (body.kinematic().has_path()) faults_.Add("kinematic.path must be left out of a prefab");
  BodyDef def = Common(body);
  const Pose pose = faults_.Normalised("pose", body.pose(), kMaxExtent_m);
  def.initial.position = pose.position;
  def.initial.orientation = pose.orientation;
  return def;
}

BodyDef BodyResolver::Common(const v1::Body& body) {
  BodyDef def;
  faults_.Name("name", body.name());
  def.name = body.name();
  if (body.motion() != v1::MOTION_UNSPECIFIED && body.motion() != v1::MOTION_DYNAMIC &&
      body.motion() != v1::MOTION_STATIC) {
    faults_.Add(absl::StrCat("motion must be MOTION_STATIC or MOTION_DYNAMIC, got ", static_cast<int>(body.motion())));
  }
  def.motion = body.motion() == v1::MOTION_STATIC ? Motion::kStatic : Motion::kDynamic;
  def.shape = shapes_.Resolve("shape", body.shape(), def.motion);
  if (body.has_kinematic()) {
    CheckKinematic(body);
    def.kinematic = true;
    def.mass_kg = def.gravity_scale = 0;
  } else if (def.motion == Motion::kStatic) {
    CheckUnmoved(body, "static");
    def.mass_kg = 0;
  } else {
    CheckDynamic(body, def);
  }
  if (!body.material().empty()) {
    if (const auto it = materials_.find(body.material()); it != materials_.end()) {
      def.material = it->second;
    } else {
      faults_.Add(absl::StrCat("material ", Quoted(body.material()), " is not among the scene's materials"));
    }
  }
  def.trigger = body.trigger();
  def.kind = Kind(body.kind());
  def.layer = Layer(body.layer());
  const bool whole = body.visible_to() != v1::VISIBILITY_PLAYER && v1::Visibility_IsValid(body.visible_to());
  if (!whole) faults_.Add("visible_to: of a body it is VISIBILITY_EVERYONE, VISIBILITY_TEAM or VISIBILITY_SERVERS");
  def.visible_to = FromProto(body.visible_to());
  if (whole && def.motion == Motion::kStatic && def.visible_to != Visibility::kEveryone) {
    faults_.Add("visible_to: the body does not move, and every client has the scene");
  }
  for (const v1::Property& property : body.properties()) {
    if (property.visible_to() != v1::VISIBILITY_UNSPECIFIED) {
      faults_.Add(
          absl::StrCat("properties: ", Quoted(property.name()), ": visible_to is said where the scene declares it"));
    }
    const std::optional<PropertyValue> value = FromProto(property);
    const absl::Status status =
        value.has_value()
            ? def.properties.Set(properties_, property.name(), *value)
            : absl::InvalidArgumentError(absl::StrCat("property ", Quoted(property.name()), " has no value"));
    if (!status.ok()) faults_.Add(absl::StrCat("properties: ", ValueField(property), ": ", status.message()));
  }
  return def;
}

std::uint16_t BodyResolver::Kind(const std::string& name) {
  const auto allowed = [](char c) { return absl::ascii_isalnum(static_cast<unsigned char>(c)) || c == '_'; };
  if (name.size() > kMaxKindLength || !std::ranges::all_of(name, allowed)) {
    faults_.Add(absl::StrCat("kind must be of at most ", kMaxKindLength, " letters, digits and underscores, got ",
                             Quoted(name)));
    return 0;
  }
  const auto known = std::ranges::find(kinds_, name);
  if (known == kinds_.end() && kinds_.size() > kMaxKinds) {
    faults_.Add(absl::StrCat("kind is the scene's ", kMaxKinds + 1, "th, of at most ", kMaxKinds));
    return 0;
  }
  const auto kind = static_cast<std::uint16_t>(known - kinds_.begin());
  if (known == kinds_.end()) kinds_.push_back(name);
  return kind;
}

CollisionLayer BodyResolver::Layer(const std::string& name) {
  if (name.empty()) return layers_.layers.front();
  const auto named = std::ranges::find(layers_.names, name);
  if (named != layers_.names.end()) return layers_.layers[static_cast<std::size_t>(named - layers_.names.begin())];
  faults_.Add(absl::StrCat("layer ", Quoted(name), " is not among the scene's layers"));
  return {};
}

void BodyResolver::CheckKinematic(const v1::Body& body) {
  if (body.motion() != v1::MOTION_UNSPECIFIED) faults_.Add("motion must be left out of a kinematic body");
  if (body.never_sleeps()) faults_.Add("never_sleeps must be left out of a kinematic body");
  CheckUnmoved(body, "kinematic");
}

void BodyResolver::CheckUnmoved(const v1::Body& body, const char* what) {
  const auto left_out = [&](const char* field, bool given) {
    if (given) faults_.Add(absl::StrCat(field, " must be left out of a ", what, " body"));
  };
  left_out("mass", body.mass() != 0);  // NaN is given, too
  left_out("inertia", body.has_inertia());
  left_out("linear_velocity", body.has_linear_velocity());
  left_out("angular_velocity", body.has_angular_velocity());
  left_out("linear_damping", body.linear_damping() != 0);
  left_out("angular_damping", body.angular_damping() != 0);
  left_out("gravity_scale", body.has_gravity_scale());
}

void BodyResolver::CheckDynamic(const v1::Body& body, BodyDef& def) {
  const bool mass = faults_.Positive("mass", body.mass(), kMinMass_kg, kMaxMass_kg);
  def.mass_kg = body.mass();
  if (mass && body.has_inertia()) CheckInertia(body, def);
  if (faults_.Length("linear_velocity", body.linear_velocity(), kMaxSpeed_m_s)) {
    def.initial.linear_velocity = Vec3f(FromProto(body.linear_velocity()));
  }
  if (faults_.Length("angular_velocity", body.angular_velocity(), kMaxAngularSpeed_rad_s)) {
    def.initial.angular_velocity = Vec3f(FromProto(body.angular_velocity()));
  }
  faults_.Range("linear_damping", body.linear_damping(), 0, 1);
  faults_.Range("angular_damping", body.angular_damping(), 0, 1);
  def.linear_damping = body.linear_damping();
  def.angular_damping = body.angular_damping();
  if (body.has_gravity_scale()) {
    const double pull = std::abs(body.gravity_scale()) * gravity_m_s2_;
    if (faults_.Range("gravity_scale", body.gravity_scale(), -1000, 1000) && pull > kMaxAcceleration_m_s2) {
      faults_.Add(absl::StrCat("gravity_scale times gravity must be at most ", kMaxAcceleration_m_s2, ", got ", pull));
    }
    def.gravity_scale = body.gravity_scale();
  }
  def.may_sleep = !body.never_sleeps();
}

void BodyResolver::CheckInertia(const v1::Body& body, BodyDef& def) {
  const double low = def.mass_kg * kMinInertiaOfMass_m2, high = def.mass_kg * kMaxInertiaOfMass_m2;
  const Vec3d inertia = FromProto(body.inertia());
  const bool x = faults_.Positive("inertia.x", inertia.x, low, high);
  const bool y = faults_.Positive("inertia.y", inertia.y, low, high);
  if (faults_.Positive("inertia.z", inertia.z, low, high) && x && y) {
    // Principal moments are sums of two of three positive integrals, so none exceeds the sum of the others.
    const double sum = inertia.x + inertia.y + inertia.z;
    for (const double moment : {inertia.x, inertia.y, inertia.z}) {
      if (moment <= (sum - moment) * (1 + kUnitTolerance)) continue;
      faults_.Add(absl::StrCat("inertia is of no body: one moment, ", moment, ", exceeds the sum of the others"));
    }
  }
  def.inertia_kg_m2 = inertia;
}

}  // namespace tessera
