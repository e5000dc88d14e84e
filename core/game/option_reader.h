// OptionReader: the named values that a function takes as one table. Each is taken by its name; what is left over has
// none. What is wrong is named as game code wrote it: "explode: `radius` must be .001 to 200, got -1".
//
//   OptionReader options(function, arguments[0]);
//   const std::optional<Vec3d> at = options.Vector("at");
//   if (absl::Status status = options.status(); !status.ok()) return status;
//
// Thread rule: one thread.
#pragma once

#include <algorithm>
#include <cmath>
#include <optional>
#include <span>
#include <string_view>
#include <vector>

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "core/game/arguments.h"
#include "core/world/limits.h"
#include "core/world/math.h"

namespace tessera::game {

class OptionReader {
 public:
  OptionReader(const Function& function, const tessera_game_value& table)
      : function_(ViewOf(function.name)), fields_(FieldsGiven(table)) {}
  // The table is the first of these, or left out; `path` goes before each name where it is said: "options.".
  OptionReader(const Function& function, CallArguments table, std::string_view path)
      : function_(ViewOf(function.name)), path_(ViewOf(path)) {
    if (IsGiven(table, 0)) fields_ = FieldsGiven(table[0]);
  }

  // The value as it was given, or null.
  const tessera_game_value* Any(std::string_view name) {
    names_.emplace_back(name.data(), name.size());
    const auto field = std::ranges::find_if(
        fields_, [&](const tessera_game_field& one) { return std::string_view(one.name, one.name_bytes) == name; });
    if (field == fields_.end()) return nullptr;
    ++taken_;
    return &field->value;
  }
  std::optional<double> Number(std::string_view name, double least, double most) {
    const tessera_game_value* const value = Any(name);
    if (value == nullptr) return std::nullopt;
    if (!IsNumber(*value)) {
      Fault(name, "must be a number");
      return std::nullopt;
    }
    const double number = NumberGiven(*value);
    // Not <: what is not a number fails, too.
    if (number >= least && number <= most) return number;
    Fault(name, absl::StrCat("must be ", least, " to ", most, ", got ", number));
    return std::nullopt;
  }
  std::optional<std::int64_t> Whole(std::string_view name, std::int64_t least, std::int64_t most) {
    const tessera_game_value* const value = Any(name);
    if (value == nullptr) return std::nullopt;
    if (value->type != TESSERA_GAME_WHOLE) {
      Fault(name, "must be a whole number");
      return std::nullopt;
    }
    if (value->as.whole >= least && value->as.whole <= most) return value->as.whole;
    Fault(name, absl::StrCat("must be ", least, " to ", most, ", got ", value->as.whole));
    return std::nullopt;
  }
  // A vector of length 1.
  std::optional<Quatd> Rotation(std::string_view name) {
    const tessera_game_value* const value = Any(name);
    if (value == nullptr) return std::nullopt;
    if (value->type != TESSERA_GAME_ROTATION) {
      Fault(name, "must be a rotation");
      return std::nullopt;
    }
    // Not >: what is not a number fails, too.
    if (std::abs(Length(RotationGiven(*value)) - 1) <= kUnitTolerance) return Normalized(RotationGiven(*value));
    Fault(name, "is not of length 1");
    return std::nullopt;
  }
  std::optional<Vec3d> Vector(std::string_view name) {
    const tessera_game_value* const value = Any(name);
    if (value == nullptr) return std::nullopt;
    if (value->type != TESSERA_GAME_VECTOR) {
      Fault(name, "must be a vector");
      return std::nullopt;
    }
    const Vec3d vector = VectorGiven(*value);
    if (IsFinite(vector)) return vector;
    Fault(name, "is not finite");
    return std::nullopt;
  }
  std::optional<std::string_view> Text(std::string_view name, std::size_t most_bytes) {
    const tessera_game_value* const value = Any(name);
    if (value == nullptr) return std::nullopt;
    const std::string_view text(value->as.text, value->type == TESSERA_GAME_TEXT ? value->count : 0);
    if (value->type == TESSERA_GAME_TEXT && !text.empty() && text.size() <= most_bytes) return text;
    Fault(name, absl::StrCat("must be a text of 1 to ", most_bytes, " bytes"));
    return std::nullopt;
  }
  // The first fault counts.
  void Fault(std::string_view name, absl::string_view what) {
    if (!status_.ok()) return;
    status_ = absl::InvalidArgumentError(absl::StrCat(function_, ": `", path_, ViewOf(name), "` ", what));
  }
  // Once all have been taken.
  absl::Status status() const {
    if (!status_.ok() || taken_ == fields_.size()) return status_;
    for (const tessera_game_field& field : fields_) {
      const absl::string_view name(field.name, std::min<std::size_t>(field.name_bytes, 63));
      if (std::ranges::find(names_, name) != names_.end()) continue;
      return absl::InvalidArgumentError(
          absl::StrCat(function_, ": `", path_, name, "` is none of ", absl::StrJoin(names_, ", ")));
    }
    return absl::InvalidArgumentError(absl::StrCat(function_, ": a name is given twice"));
  }

 private:
  const absl::string_view function_, path_;
  std::span<const tessera_game_field> fields_;
  std::vector<absl::string_view> names_;
  std::size_t taken_ = 0;
  absl::Status status_;
};

}  // namespace tessera::game
