#include "core/game/value.h"

#include <cmath>
#include <optional>
#include <string_view>

#include "absl/strings/str_cat.h"
#include "core/world/bytes.h"

namespace tessera::game {
namespace {

constexpr std::size_t kMaxFieldNameBytes = 63;

absl::Status FieldFault(absl::string_view name, absl::string_view what) {
  return absl::InvalidArgumentError(name.empty() ? absl::StrCat("values: ", what)
                                                 : absl::StrCat("values.", name, ": ", what));
}

bool IsFinite(const GameValue& value) {
  if (const auto* real = std::get_if<double>(&value)) return std::isfinite(*real);
  if (const auto* vector = std::get_if<Vec3d>(&value)) return tessera::IsFinite(*vector);
  return true;
}

std::string ReadText(ByteReader& in) {
  const auto bytes = in.Block(kMaxMessageBytes);
  return {bytes.begin(), bytes.end()};
}

struct Writer {
  ByteWriter& out;
  void operator()(bool flag) const { out.U8(flag ? 1 : 0); }
  void operator()(std::int64_t whole) const { out.U64(static_cast<std::uint64_t>(whole)); }
  void operator()(double real) const { out.F64(real); }
  void operator()(const std::string& text) const { out.Block(std::string_view(text)); }
  void operator()(const Vec3d& v) const { out.V(v); }
  void operator()(BodyId id) const { out.Varint(id.value()); }
  void operator()(PlayerNumber number) const { out.Varint(number.value()); }
};

std::optional<GameValue> Read(ByteReader& in, std::uint8_t type) {
  switch (type) {
    case 0: {
      const std::uint8_t flag = in.U8();
      if (flag > 1) return std::nullopt;
      return flag == 1;
    }
    case 1:
      return static_cast<std::int64_t>(in.U64());
    case 2:
      return in.F64();
    case 3:
      return ReadText(in);
    case 4:
      return in.V3d();
    case 5:
      return BodyId(in.Varint());
    case 6: {
      const std::uint64_t number = in.Varint();
      if (number > UINT32_MAX) return std::nullopt;
      return PlayerNumber(static_cast<std::uint32_t>(number));
    }
    default:
      return std::nullopt;
  }
}

}  // namespace

absl::StatusOr<GameFields> FieldsFrom(const tessera_game_value& value) {
  GameFields fields;
  fields.reserve(value.count);
  for (std::uint32_t i = 0; i < value.count; ++i) {
    const tessera_game_field& field = value.as.fields[i];
    std::string name(field.name, field.name_bytes);
    if (name.empty() || name.size() > kMaxFieldNameBytes)
      return FieldFault("", "a name is empty or longer than 63 bytes");
    if (!fields.empty() && fields.back().first >= name) return FieldFault("", "names do not ascend");
    std::optional<GameValue> kept = FromInterface(field.value);
    if (!kept) return FieldFault(name, "is of a type that cannot be kept");
    if (!IsFinite(*kept)) return FieldFault(name, "is not finite");
    fields.emplace_back(std::move(name), *std::move(kept));
  }
  return fields;
}

absl::StatusOr<std::vector<std::uint8_t>> EncodeFields(const GameFields& fields, std::size_t limit) {
  ByteWriter out;
  for (const auto& [name, value] : fields) {
    out.Block(std::string_view(name));
    out.U8(static_cast<std::uint8_t>(value.index()));
    std::visit(Writer{out}, value);
  }
  std::vector<std::uint8_t> bytes = out.Take();
  if (bytes.size() > limit) {
    return absl::ResourceExhaustedError(absl::StrCat("values: take ", bytes.size(), " bytes, more than ", limit));
  }
  return bytes;
}

absl::StatusOr<GameFields> DecodeFields(std::span<const std::uint8_t> bytes, std::size_t limit) {
  if (bytes.size() > limit) return FieldFault("", "are too long");
  ByteReader in(bytes);
  GameFields fields;
  while (in.ok() && in.remaining() > 0) {
    std::string name = ReadText(in);
    const std::uint8_t type = in.U8();
    std::optional<GameValue> value = Read(in, type);
    if (!in.ok()) break;
    if (!value) return FieldFault("", "one is of an unknown type");
    if (name.empty() || name.size() > kMaxFieldNameBytes)
      return FieldFault("", "a name is empty or longer than 63 bytes");
    if (!fields.empty() && fields.back().first >= name) return FieldFault("", "names do not ascend");
    if (!IsFinite(*value)) return FieldFault(name, "is not finite");
    fields.emplace_back(std::move(name), *std::move(value));
  }
  if (!in.ok()) return FieldFault("", in.error());
  return fields;
}

std::optional<GameValue> FromInterface(const tessera_game_value& value) {
  switch (value.type) {
    case TESSERA_GAME_FLAG:
      return value.as.whole != 0;
    case TESSERA_GAME_WHOLE:
      return value.as.whole;
    case TESSERA_GAME_REAL:
      return value.as.real;
    case TESSERA_GAME_TEXT:
      return std::string(value.as.text, value.count);
    case TESSERA_GAME_VECTOR:
      return Vec3d{value.as.vector[0], value.as.vector[1], value.as.vector[2]};
    case TESSERA_GAME_BODY:
      return BodyId(value.as.id);
    case TESSERA_GAME_PLAYER:
      return PlayerNumber(static_cast<std::uint32_t>(value.as.id));
    default:
      return std::nullopt;
  }
}

std::optional<PropertyValue> PropertyFrom(const tessera_game_value& value, const PropertyDef& def) {
  if (value.type == TESSERA_GAME_NOTHING) return BodyId();
  const std::optional<GameValue> given = FromInterface(value);
  if (!given) return std::nullopt;
  if (const auto* flag = std::get_if<bool>(&*given)) return *flag;
  if (const auto* whole = std::get_if<std::int64_t>(&*given)) {
    if (std::holds_alternative<double>(def.initial)) return static_cast<double>(*whole);
    return *whole;
  }
  if (const auto* real = std::get_if<double>(&*given)) return *real;
  if (const auto* vector = std::get_if<Vec3d>(&*given)) return *vector;
  if (const auto* body = std::get_if<BodyId>(&*given)) return *body;
  const auto* text = std::get_if<std::string>(&*given);
  if (text == nullptr) return std::nullopt;
  if (std::holds_alternative<PropertyBytes>(def.initial)) return PropertyBytes{{text->begin(), text->end()}};
  return *text;
}

tessera_game_value ToInterface(const GameValue& value) {
  tessera_game_value out{};
  struct Setter {
    tessera_game_value& out;
    void operator()(bool flag) const { out.type = TESSERA_GAME_FLAG, out.as.whole = flag ? 1 : 0; }
    void operator()(std::int64_t whole) const { out.type = TESSERA_GAME_WHOLE, out.as.whole = whole; }
    void operator()(double real) const { out.type = TESSERA_GAME_REAL, out.as.real = real; }
    void operator()(const std::string& text) const {
      out.type = TESSERA_GAME_TEXT;
      out.count = static_cast<std::uint32_t>(text.size());
      out.as.text = text.data();
    }
    void operator()(const Vec3d& v) const {
      out.type = TESSERA_GAME_VECTOR;
      out.as.vector[0] = v.x, out.as.vector[1] = v.y, out.as.vector[2] = v.z;
    }
    void operator()(BodyId id) const { out.type = TESSERA_GAME_BODY, out.as.id = id.value(); }
    void operator()(PlayerNumber number) const { out.type = TESSERA_GAME_PLAYER, out.as.id = number.value(); }
  };
  std::visit(Setter{out}, value);
  return out;
}

}  // namespace tessera::game
