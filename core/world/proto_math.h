// Conversion of vectors, quaternions and boxes to and from their messages. Nothing is checked.
#pragma once

#include <optional>
#include <string>
#include <variant>

#include "core/world/bounds.h"
#include "core/world/math.h"
#include "core/world/properties.h"
#include "tessera/v1/scene.pb.h"

namespace tessera {

inline Vec3d FromProto(const v1::Vec3& v) { return {v.x(), v.y(), v.z()}; }
inline Aabb FromProto(const v1::Box& box) { return {FromProto(box.min()), FromProto(box.max())}; }
// All zero, as in a message without it, means no rotation.
inline Quatd FromProto(const v1::Quat& q) {
  const Quatd out{q.x(), q.y(), q.z(), q.w()};
  return out == Quatd(0, 0, 0, 0) ? Quatd() : out;
}
inline Pose FromProto(const v1::Pose& pose) { return {FromProto(pose.position()), FromProto(pose.orientation())}; }

// Nothing if the message has no value.
inline std::optional<PropertyValue> FromProto(const v1::Property& property) {
  switch (property.value_case()) {
    case v1::Property::kFlag:
      return property.flag();
    case v1::Property::kNumber:
      return std::int64_t{property.number()};
    case v1::Property::kReal:
      return property.real();
    case v1::Property::kText:
      return property.text();
    case v1::Property::kVector:
      return FromProto(property.vector());
    case v1::Property::kBody:
      return BodyId(property.body());
    case v1::Property::kBytes:
      return PropertyBytes{{property.bytes().begin(), property.bytes().end()}};
    case v1::Property::VALUE_NOT_SET:
      break;
  }
  return std::nullopt;
}

// Left out: everyone.
inline Visibility FromProto(v1::Visibility visible_to) {
  switch (visible_to) {
    case v1::VISIBILITY_PLAYER:
      return Visibility::kPlayer;
    case v1::VISIBILITY_SERVERS:
      return Visibility::kServers;
    case v1::VISIBILITY_TEAM:
      return Visibility::kTeam;
    default:
      return Visibility::kEveryone;
  }
}

// The name of the field that holds the value, for errors.
inline std::string ValueField(const v1::Property& property) {
  switch (property.value_case()) {
    case v1::Property::kFlag:
      return "flag";
    case v1::Property::kNumber:
      return "number";
    case v1::Property::kReal:
      return "real";
    case v1::Property::kText:
      return "text";
    case v1::Property::kVector:
      return "vector";
    case v1::Property::kBody:
      return "body";
    case v1::Property::kBytes:
      return "bytes";
    case v1::Property::VALUE_NOT_SET:
      break;
  }
  return "value";
}

inline v1::Vec3 ToProto(Vec3d v) {
  v1::Vec3 out;
  out.set_x(v.x);
  out.set_y(v.y);
  out.set_z(v.z);
  return out;
}
inline v1::Property ToProto(const std::string& name, const PropertyValue& value) {
  v1::Property property;
  property.set_name(name);
  if (const auto* flag = std::get_if<bool>(&value)) property.set_flag(*flag);
  if (const auto* number = std::get_if<std::int64_t>(&value)) property.set_number(*number);
  if (const auto* real = std::get_if<double>(&value)) property.set_real(*real);
  if (const auto* text = std::get_if<std::string>(&value)) property.set_text(*text);
  if (const auto* vector = std::get_if<Vec3d>(&value)) *property.mutable_vector() = ToProto(*vector);
  if (const auto* body = std::get_if<BodyId>(&value)) property.set_body(body->value());
  if (const auto* blob = std::get_if<PropertyBytes>(&value)) {
    property.set_bytes(blob->bytes.data(), blob->bytes.size());
  }
  return property;
}

inline v1::Quat ToProto(Quatd q) {
  v1::Quat out;
  out.set_x(q.x);
  out.set_y(q.y);
  out.set_z(q.z);
  out.set_w(q.w);
  return out;
}
inline v1::Pose ToProto(const Pose& pose) {
  v1::Pose out;
  *out.mutable_position() = ToProto(pose.position);
  *out.mutable_orientation() = ToProto(pose.orientation);
  return out;
}
inline v1::Box ToProto(const Aabb& box) {
  v1::Box out;
  *out.mutable_min() = ToProto(box.min);
  *out.mutable_max() = ToProto(box.max);
  return out;
}

}  // namespace tessera
