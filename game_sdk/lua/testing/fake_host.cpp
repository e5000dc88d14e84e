#include "game_sdk/lua/testing/fake_host.h"

#include <cstdio>
#include <cstring>
#include <map>

namespace tessera::game {
namespace {

FakeHost* current = nullptr;

int CallCurrent(tessera_game_call*, std::uint32_t function, const tessera_game_value* arguments, std::uint32_t count,
                tessera_game_value* result) {
  return current->Call(function, arguments, count, result);
}

const char* ErrorOfCurrent(const tessera_game_call*) { return current->error.c_str(); }

int ChargeCurrent(tessera_game_call*, std::uint64_t instructions) {
  current->work += instructions;
  return current->work <= current->budget ? 0 : 1;
}

std::string Number(double number) {
  char text[40];
  std::snprintf(text, sizeof text, "%.14g", number);
  return text;
}

}  // namespace

FakeHost::FakeHost() : abi{sizeof abi, CallCurrent, ErrorOfCurrent, ChargeCurrent} { current = this; }
FakeHost::~FakeHost() { current = nullptr; }

int FakeHost::Property(std::uint32_t function, const tessera_game_value* arguments, tessera_game_value* result) {
  const std::map<std::string, Types> declared = {
      {"health", kWholeType}, {"speed", kRealType | kWholeType}, {"tag", kTextType}, {"open", kFlagType}};
  const std::string name(arguments[1].as.text, arguments[1].count);
  const auto found = declared.find(name);
  if (found == declared.end()) {
    error = (function == kBodyGet ? "get: no property `" : "set: no property `") + name + "`";
    return 1;
  }
  if (function == kBodyGet) {
    *result = {};
    result->type = TESSERA_GAME_WHOLE;
    result->as.whole = 10;
    return 0;
  }
  if ((TypeBit(static_cast<tessera_game_type>(arguments[2].type)) & found->second) == 0) {
    error = "set: `" + name + "` has another type";
    return 1;
  }
  return 0;
}

int FakeHost::Call(std::uint32_t number, const tessera_game_value* arguments, std::uint32_t count,
                   tessera_game_value* result) {
  const Function& function = *FindFunction(number);
  std::string line = std::string(function.name) + "(";
  for (std::uint32_t i = 0; i < count; ++i) line += (i == 0 ? "" : ", ") + Describe(arguments[i]);
  if (function.result == kNothingType || number == kBodyAfter) lines.push_back(line + ")");
  *result = {};
  switch (number) {
    case kWorldTick:
      result->type = TESSERA_GAME_WHOLE;
      result->as.whole = 42;
      return 0;
    case kWorldRandom:
      result->type = TESSERA_GAME_REAL;
      result->as.real = static_cast<double>(++random_calls * 2654435761 % 1000) / 1000;
      return 0;
    case kBodyKind:
      *result = Text(arguments[0].as.id % 2 == 0 ? "crate" : "player");
      return 0;
    case kBodyPosition:
      result->type = TESSERA_GAME_VECTOR;
      result->as.vector[0] = static_cast<double>(arguments[0].as.id);
      return 0;
    case kBodyRotation:  // a quarter turn about z
      result->type = TESSERA_GAME_ROTATION;
      result->as.rotation[2] = result->as.rotation[3] = 0.70710678118654757;
      return 0;
    case kBodyPlayer:
      if (arguments[0].as.id % 2 == 0) return 0;
      result->type = TESSERA_GAME_PLAYER;
      result->as.id = 1;
      return 0;
    case kBodyIsOwn:
      result->type = TESSERA_GAME_FLAG;
      result->as.whole = 1;
      return 0;
    case kBodyAfter:
      result->type = TESSERA_GAME_WHOLE;
      result->as.whole = 5;
      return 0;
    case kBodyGet:
    case kBodySet:
      return Property(number, arguments, result);
    case kWorldLog:
    case kBodyImpulse:
      return 0;
    default:
      error = std::string(function.name) + ": the body is gone";
      return 1;
  }
}

std::string Describe(const tessera_game_value& value) {
  const double* const axes = value.as.vector;
  switch (value.type) {
    case TESSERA_GAME_NOTHING:
      return "nothing";
    case TESSERA_GAME_FLAG:
      return value.as.whole != 0 ? "true" : "false";
    case TESSERA_GAME_WHOLE:
      return std::to_string(value.as.whole);
    case TESSERA_GAME_REAL:
      return "real " + Number(value.as.real);
    case TESSERA_GAME_TEXT:
      return "\"" + std::string(value.as.text, value.count) + "\"";
    case TESSERA_GAME_VECTOR:
      return "(" + Number(axes[0]) + ", " + Number(axes[1]) + ", " + Number(axes[2]) + ")";
    case TESSERA_GAME_BODY:
      return "body " + std::to_string(value.as.id);
    case TESSERA_GAME_PLAYER:
      return "player " + std::to_string(value.as.id);
    case TESSERA_GAME_FIELDS: {
      std::string text = "{";
      for (std::uint32_t i = 0; i < value.count; ++i) {
        const tessera_game_field& field = value.as.fields[i];
        text += (i == 0 ? "" : ", ") + std::string(field.name, field.name_bytes) + "=" + Describe(field.value);
      }
      return text + "}";
    }
    default:
      return "?";
  }
}

tessera_game_value Body(std::uint64_t id) {
  tessera_game_value value{};
  value.type = TESSERA_GAME_BODY;
  value.as.id = id;
  return value;
}

tessera_game_value Text(const char* text) {
  tessera_game_value value{};
  value.type = TESSERA_GAME_TEXT;
  value.count = static_cast<std::uint32_t>(std::strlen(text));
  value.as.text = text;
  return value;
}

}  // namespace tessera::game
