#include "control_plane/game_fields.h"

#include <algorithm>
#include <optional>
#include <utility>

#include "absl/strings/str_cat.h"
#include "core/world/proto_math.h"
#include "core/world/utf8.h"

namespace tessera::control {
namespace {

constexpr std::size_t kMaxFieldNameBytes = 63;

std::optional<game::GameValue> ValueOf(const v1::GameField& field) {
  switch (field.value_case()) {
    case v1::GameField::kFlag:
      return field.flag();
    case v1::GameField::kNumber:
      return std::int64_t{field.number()};
    case v1::GameField::kReal:
      return field.real();
    case v1::GameField::kText:
      return field.text();
    case v1::GameField::kVector:
      return FromProto(field.vector());
    case v1::GameField::kBody:
      return BodyId(field.body());
    case v1::GameField::kBytes:
      return field.bytes();
    case v1::GameField::kPlayer:
      return PlayerNumber(field.player());
    case v1::GameField::VALUE_NOT_SET:
      break;
  }
  return std::nullopt;
}

struct FieldWriter {
  v1::GameField& out;
  void operator()(bool flag) const { out.set_flag(flag); }
  void operator()(std::int64_t number) const { out.set_number(number); }
  void operator()(double real) const { out.set_real(real); }
  void operator()(const std::string& text) const { IsUtf8(text) ? out.set_text(text) : out.set_bytes(text); }
  void operator()(const Vec3d& vector) const {
    out.mutable_vector()->set_x(vector.x);
    out.mutable_vector()->set_y(vector.y);
    out.mutable_vector()->set_z(vector.z);
  }
  void operator()(BodyId body) const { out.set_body(body.value()); }
  void operator()(PlayerNumber player) const { out.set_player(player.value()); }
};

}  // namespace

absl::StatusOr<std::vector<std::uint8_t>> EncodeGameFields(const GameFieldList& fields) {
  game::GameFields kept;
  for (int i = 0; i < fields.size(); ++i) {
    const std::string& name = fields[i].name();
    if (name.empty() || name.size() > kMaxFieldNameBytes) {
      return absl::InvalidArgumentError(absl::StrCat("values[", i, "].name: is empty or longer than 63 bytes"));
    }
    std::optional<game::GameValue> value = ValueOf(fields[i]);
    if (!value) return absl::InvalidArgumentError(absl::StrCat("values[", i, "]: has no value"));
    kept.emplace_back(name, *std::move(value));
  }
  std::ranges::sort(kept, {}, [](const auto& field) { return field.first; });
  const auto twice = std::ranges::adjacent_find(kept, {}, [](const auto& field) { return field.first; });
  if (twice != kept.end()) {
    return absl::InvalidArgumentError(absl::StrCat("values.", twice->first, ": is there twice"));
  }
  auto bytes = game::EncodeFields(kept, game::kMaxMessageBytes);
  if (!bytes.ok()) return absl::InvalidArgumentError(bytes.status().message());
  // Fields that no game could have made are found here.
  if (const auto sound = game::DecodeFields(*bytes, game::kMaxMessageBytes); !sound.ok()) return sound.status();
  return bytes;
}

GameFieldList DecodeGameFields(std::string_view bytes) {
  GameFieldList list;
  const std::vector<std::uint8_t> kept(bytes.begin(), bytes.end());
  const auto fields = game::DecodeFields(kept, game::kMaxMessageBytes);
  if (!fields.ok()) return list;
  for (const auto& [name, value] : *fields) {
    v1::GameField& out = *list.Add();
    out.set_name(ValidUtf8(name));
    std::visit(FieldWriter{out}, value);
  }
  return list;
}

}  // namespace tessera::control
