#include "game_sdk/tools/reference.h"

#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "absl/strings/str_replace.h"
#include "game_sdk/api/api.h"

namespace tessera::game {
namespace {

absl::string_view TextView(std::string_view text) { return {text.data(), text.size()}; }

struct ReceiverNames {
  Receiver receiver;
  const char* prefix;  // before a function: "world.tick()"
  const char* title;
  const char* method;  // before a function's name in annotations
};
constexpr ReceiverNames kReceivers[] = {{Receiver::kWorld, "world.", "The world", "world."},
                                        {Receiver::kBody, "body:", "Bodies", "Body:"},
                                        {Receiver::kPlayer, "player:", "Players", "Player:"}};

// --- Markdown

std::string TypeNames(Types types) {
  std::vector<absl::string_view> names;
  for (unsigned type = 0; type < 32; ++type) {
    if ((types >> type & 1) != 0) names.push_back(TextView(TypeName(static_cast<tessera_game_type>(type))));
  }
  return absl::StrJoin(names, " or ");
}

// The text as it may stand in a cell of a table.
std::string Cell(std::string_view text) { return absl::StrReplaceAll(TextView(text), {{"|", "\\|"}}); }

// "impulse[, point]"
std::string Signature(std::span<const Parameter> parameters) {
  std::string text, ends;
  for (const Parameter& parameter : parameters) {
    absl::StrAppend(&text, parameter.optional ? "[" : "", &parameter == parameters.data() ? "" : ", ",
                    TextView(parameter.name));
    if (parameter.optional) ends += "]";
  }
  return text + ends;
}

std::string ParameterList(std::span<const Parameter> parameters) {
  return absl::StrJoin(parameters, "<br>", [](std::string* out, const Parameter& parameter) {
    absl::StrAppend(out, "`", TextView(parameter.name), "`: ", TypeNames(parameter.types), "; ", Cell(parameter.doc));
  });
}

template <class Entry>
bool HasAny(std::span<const Entry> entries, Receiver receiver) {
  for (const Entry& entry : entries) {
    if (entry.receiver == receiver) return true;
  }
  return false;
}

void WriteFunctions(const ReceiverNames& names, std::string& out) {
  if (!HasAny(Functions(), names.receiver)) return;
  absl::StrAppend(&out, "### ", names.title, ": functions\n\n",
                  "| function | gives | what it does | parameters |\n|---|---|---|---|\n");
  for (const Function& function : Functions()) {
    if (function.receiver != names.receiver) continue;
    absl::StrAppend(&out, "| `", names.prefix, TextView(function.name), "(", Signature(function.parameters), ")` | ",
                    TypeNames(function.result), " | ", Cell(function.doc), " | ", ParameterList(function.parameters),
                    " |\n");
  }
  out += "\n";
}

void WriteCallbacks(const ReceiverNames& names, std::string& out) {
  if (!HasAny(Callbacks(), names.receiver)) return;
  absl::StrAppend(&out, "### ", names.title, ": callbacks\n\n", "| callback | when | parameters |\n|---|---|---|\n");
  const char* const self = names.receiver == Receiver::kBody ? "self" : "player";
  for (const Callback& callback : Callbacks()) {
    if (callback.receiver != names.receiver) continue;
    std::string signature = Signature(callback.parameters);
    if (names.receiver != Receiver::kWorld) signature = signature.empty() ? self : absl::StrCat(self, ", ", signature);
    absl::StrAppend(&out, "| `", TextView(callback.name), "(", signature, ")` | ", Cell(callback.doc), " | ",
                    ParameterList(callback.parameters), " |\n");
  }
  out += "\n";
}

// --- Annotations

const char* OneAnnotation(tessera_game_type type) {
  switch (type) {
    case TESSERA_GAME_NOTHING:
      return "nil";
    case TESSERA_GAME_FLAG:
      return "boolean";
    case TESSERA_GAME_WHOLE:
      return "integer";
    case TESSERA_GAME_REAL:
      return "number";
    case TESSERA_GAME_TEXT:
      return "string";
    case TESSERA_GAME_VECTOR:
      return "Vector";
    case TESSERA_GAME_ROTATION:
      return "Rotation";
    case TESSERA_GAME_BODY:
      return "Body";
    case TESSERA_GAME_PLAYER:
      return "Player";
    case TESSERA_GAME_LIST:
      return "any[]";
    case TESSERA_GAME_FIELDS:
      return "table<string, any>";
    default:
      return "any";
  }
}

std::string AnnotationOf(Types types) {
  std::vector<std::string> names;
  for (unsigned type = 0; type < 32; ++type) {
    if ((types >> type & 1) != 0) names.emplace_back(OneAnnotation(static_cast<tessera_game_type>(type)));
  }
  return absl::StrJoin(names, "|");
}

void AnnotateParameters(std::span<const Parameter> parameters, std::string& out) {
  for (const Parameter& parameter : parameters) {
    absl::StrAppend(&out, "---@param ", TextView(parameter.name), parameter.optional ? "? " : " ",
                    AnnotationOf(parameter.types), " ", TextView(parameter.doc), "\n");
  }
}

std::string NamesOf(std::span<const Parameter> parameters) {
  return absl::StrJoin(parameters, ", ",
                       [](std::string* out, const Parameter& parameter) { out->append(parameter.name); });
}

void AnnotateFunctions(const ReceiverNames& names, std::string& out) {
  for (const Function& function : Functions()) {
    if (function.receiver != names.receiver) continue;
    absl::StrAppend(&out, "---", TextView(function.doc), "\n");
    AnnotateParameters(function.parameters, out);
    if (function.result != kNothingType) absl::StrAppend(&out, "---@return ", AnnotationOf(function.result), "\n");
    absl::StrAppend(&out, "function ", names.method, TextView(function.name), "(", NamesOf(function.parameters),
                    ") end\n\n");
  }
}

// "fun(self: Body, other: Body)"
std::string FunctionType(const Callback& callback) {
  std::vector<std::string> parameters;
  if (callback.receiver == Receiver::kBody) parameters.emplace_back("self: Body");
  if (callback.receiver == Receiver::kPlayer) parameters.emplace_back("player: Player");
  for (const Parameter& parameter : callback.parameters) {
    parameters.push_back(absl::StrCat(TextView(parameter.name), ": ", AnnotationOf(parameter.types)));
  }
  return absl::StrCat("fun(", absl::StrJoin(parameters, ", "), ")");
}

void AnnotateCallbacks(std::string& out) {
  out += "---Callbacks of the bodies of one kind.\n---@class KindCallbacks\n";
  for (const Callback& callback : Callbacks()) {
    if (callback.receiver != Receiver::kBody) continue;
    absl::StrAppend(&out, "---@field ", TextView(callback.name), "? ", FunctionType(callback), " ",
                    TextView(callback.doc), "\n");
  }
  out +=
      "\n---Callbacks of bodies, by the kind that the scene gives them.\n---@type table<string, KindCallbacks>\n"
      "kinds = {}\n\n";
  for (const Callback& callback : Callbacks()) {
    if (callback.receiver == Receiver::kBody) continue;
    absl::StrAppend(&out, "---Callback of the ", callback.receiver == Receiver::kWorld ? "world" : "players",
                    ", as the game defines it: ", TextView(callback.doc), "\n---@type ", FunctionType(callback), "\n",
                    TextView(callback.name), " = nil\n\n");
  }
}

constexpr char kAnnotationHead[] = R"lua(---@meta
-- What game code of Tessera finds, for editors with the Lua language server. `tessera game new` writes this file anew.

---A vector that does not change; m, m/s, N s and so on.
---@class Vector
---@field x number
---@field y number
---@field z number
---@operator add(Vector): Vector
---@operator sub(Vector): Vector
---@operator mul(number): Vector
---@operator div(number): Vector
---@operator unm: Vector
---@field length fun(self: Vector): number
---@field normalized fun(self: Vector): Vector
---@field dot fun(self: Vector, other: Vector): number
---@field cross fun(self: Vector, other: Vector): Vector

---A rotation that does not change.
---@class Rotation
---@field apply fun(self: Rotation, vector: Vector): Vector

---@param x number
---@param y number
---@param z number
---@return Vector
function vec(x, y, z) end

---A body, wherever it is. Its properties are fields.
---@class Body
---@field [string] boolean|integer|number|string
local Body = {}

---A player.
---@class Player
local Player = {}

---The world.
world = {}

)lua";

constexpr char kTestAnnotations[] = R"lua(---A test of game_test.lua: `t` in test("name", function(t) ... end).
---@class GameTest
local GameTest = {}

---@param name string
---@param run fun(t: GameTest)
function test(name, run) end

---Makes so many ticks; without a number one.
---@param ticks? integer
function GameTest:step(ticks) end

---Makes ticks until the condition holds, and returns how many; fails where it does not within `ticks`.
---@param ticks integer
---@param condition fun(): boolean
---@return integer
function GameTest:step_until(ticks, condition) end

---Number of the last tick.
---@return integer
function GameTest:tick() end

---The body of this name in the scene, or of this id.
---@param name string|integer
---@return Body
function GameTest:body(name) end

---All bodies, or those of a kind, by their ids.
---@param kind? string
---@return Body[]
function GameTest:bodies(kind) end

---Sets where a body is and how it moves, at once.
---@param body Body
---@param state { position?: Vector, rotation?: Rotation, velocity?: Vector, spin?: Vector }
function GameTest:place(body, state) end

---The region that owns the body dies.
---@param body Body
function GameTest:kill_region_of(body) end

---The number of the region that owns the body; 0 for one that does not move.
---@param body Body
---@return integer
function GameTest:region_of(body) end

---Number of regions that live.
---@return integer
function GameTest:regions() end

---A player joins; its body is there after the next tick.
---@return Body
function GameTest:join() end

---The player with this body leaves.
---@param body Body
function GameTest:leave(body) end

---An input of the player with this body, for one tick; N, N m.
---@param body Body
---@param force Vector
---@param torque? Vector
function GameTest:input(body, force, torque) end

---All lines that the game has written.
---@return string[]
function GameTest:lines() end

---All errors of the game.
---@return string[]
function GameTest:errors() end

---Errors of the game fail this test no more.
function GameTest:allow_errors() end

---@param condition any
---@param text? string
function GameTest:expect(condition, text) end

---@param got any
---@param expected any
---@param text? string
function GameTest:expect_equal(got, expected, text) end

---Numbers, or vectors by their distance.
---@param got number|Vector
---@param expected number|Vector
---@param tolerance number
---@param text? string
function GameTest:expect_near(got, expected, tolerance, text) end
)lua";

}  // namespace

std::string GameReference() {
  std::string out;
  for (const ReceiverNames& names : kReceivers) {
    WriteCallbacks(names, out);
    WriteFunctions(names, out);
  }
  return out;
}

std::string GameAnnotations() {
  std::string out = kAnnotationHead;
  for (const ReceiverNames& names : kReceivers) AnnotateFunctions(names, out);
  AnnotateCallbacks(out);
  return out + kTestAnnotations;
}

absl::StatusOr<std::string> WithReference(std::string_view document) {
  const std::size_t begin = document.find(kReferenceBegin), end = document.find(kReferenceEnd);
  if (begin == std::string_view::npos || end == std::string_view::npos || end < begin) {
    const auto line = [](std::string_view text) { return TextView(text.substr(0, text.size() - 1)); };
    return absl::InvalidArgumentError(absl::StrCat("no place for the reference: it stands between the lines ",
                                                   line(kReferenceBegin), " and ", line(kReferenceEnd)));
  }
  const std::size_t text = begin + kReferenceBegin.size();
  return absl::StrCat(TextView(document.substr(0, text)), "\n", GameReference(), TextView(document.substr(end)));
}

}  // namespace tessera::game
