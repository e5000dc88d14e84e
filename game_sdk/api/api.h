// The table of what game code may call and what it is called with. From it come the checks of arguments, the Lua
// functions, the documents (docs/games.md) and the annotations of editors; nothing else lists them.
//
//   const Function* impulse = FindFunction(Receiver::kBody, "impulse");
//
// Numbers never change and are never used again: native modules are compiled with them.
//
// Thread rule: constants.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <string_view>

#include "game_sdk/include/tessera/game.h"

namespace tessera::game {

// Sets of tessera_game_type.
using Types = std::uint32_t;
constexpr Types TypeBit(tessera_game_type type) { return Types{1} << static_cast<unsigned>(type); }

inline constexpr Types kNothingType = TypeBit(TESSERA_GAME_NOTHING), kFlagType = TypeBit(TESSERA_GAME_FLAG),
                       kWholeType = TypeBit(TESSERA_GAME_WHOLE), kRealType = TypeBit(TESSERA_GAME_REAL),
                       kTextType = TypeBit(TESSERA_GAME_TEXT), kVectorType = TypeBit(TESSERA_GAME_VECTOR),
                       kRotationType = TypeBit(TESSERA_GAME_ROTATION), kBodyType = TypeBit(TESSERA_GAME_BODY),
                       kPlayerType = TypeBit(TESSERA_GAME_PLAYER), kListType = TypeBit(TESSERA_GAME_LIST),
                       kFieldsType = TypeBit(TESSERA_GAME_FIELDS);
// The types of properties: nothing stands for no body, and a text holds bytes as well.
inline constexpr Types kPropertyType =
    kNothingType | kFlagType | kWholeType | kRealType | kTextType | kVectorType | kBodyType;

struct Parameter {
  std::string_view name;
  Types types;  // a whole number is taken where a real one is asked for
  std::string_view doc;
  bool optional = false;  // optional ones come last
  // Named values that are used by the call alone: lists and rotations may be among them, which values that are kept may
  // not hold.
  bool options = false;
};

// The one that has a function, or that a callback is about: for bodies and players it is the first argument, which
// `parameters` leaves out.
enum class Receiver : std::uint8_t { kWorld, kBody, kPlayer };

struct Function {
  std::uint32_t number;
  Receiver receiver;
  std::string_view name;
  std::span<const Parameter> parameters;
  Types result;
  std::string_view doc;
};

struct Callback {
  std::uint32_t number;
  Receiver receiver;
  std::string_view name;
  std::span<const Parameter> parameters;
  std::string_view doc;
};

enum FunctionNumber : std::uint32_t {
  kWorldTick = 1,
  kWorldTickRate = 2,
  kWorldRandom = 3,
  kWorldLog = 4,
  kWorldSpawn = 5,
  kWorldRay = 10,
  kWorldRayAll = 11,
  kWorldSweep = 12,
  kWorldOverlap = 13,
  kWorldAskRay = 14,
  kWorldAskSweep = 15,
  kWorldAskOverlap = 16,
  kWorldExplode = 20,
  kWorldGet = 60,
  kWorldSet = 61,
  kWorldAfter = 62,
  kWorldCancel = 63,
  kWorldSend = 64,
  kWorldIsOwn = 65,
  kWorldPublish = 66,
  kWorldPlayers = 70,
  kWorldBroadcast = 71,
  kWorldTime = 85,
  kWorldCount = 86,
  kBodyIsHere = 32,
  kBodyIsOwn = 33,
  kBodyKind = 34,
  kBodyPosition = 35,
  kBodyRotation = 36,
  kBodyVelocity = 37,
  kBodySpin = 38,
  kBodyMass = 39,
  kBodyPlayer = 40,
  kBodyGet = 41,
  kBodySet = 42,
  kBodyImpulse = 43,
  kBodySetVelocity = 44,
  kBodyAfter = 45,
  kBodyCancel = 46,
  kBodyRemove = 47,
  kBodyExpireAfter = 48,
  kBodyMember = 49,
  kBodySend = 160,
  kBodyPushFor = 170,
  kBodyCancelPush = 171,
  kBodySetSpin = 172,
  kBodyTeleport = 173,
  kBodyWake = 174,
  kBodySetGravity = 175,
  kBodySetMaterial = 176,
  kBodyMoveTo = 177,
  kBodyConnect = 178,
  kBodyDisconnect = 179,
  kBodyIsConnected = 180,
  kBodyShowTo = 181,
  kBodyController = 182,
  kPlayerName = 200,
  kPlayerBody = 201,
  kPlayerIsOwn = 202,
  kPlayerRefuse = 203,
  kPlayerKick = 204,
  kPlayerSend = 205,
  kPlayerPlace = 206,
  kPlayerSpectate = 207,
  kPlayerRespawn = 208,
  kPlayerIsSpectating = 209,
  kPlayerControl = 210,
  kPlayerControlled = 211,
  kPlayerSetLimits = 212,
  kPlayerInput = 240,
  kPlayerShownTime = 241,
  kPlayerNumber = 242,
};

enum CallbackNumber : std::uint32_t {
  kOnTick = 1,
  kOnWorldTimer = 10,
  kOnWorldMessage = 11,
  kOnWorldAnswer = 12,
  kOnJoin = 15,
  kOnLeave = 16,
  kOnCommand = 17,
  kOnControl = 18,
  kOnWorldMigrate = 19,
  kOnBodyMigrate = 20,
  kOnBodyTick = 32,
  kOnBodyContact = 33,
  kOnBodyContactEnded = 34,
  kOnBodyEntered = 35,
  kOnBodyLeft = 36,
  kOnBodyTimer = 37,
  kOnBodyMessage = 45,
  kOnBodyAnswer = 47,
  kOnBodyBlast = 48,
};

// Ascending by number.
std::span<const Function> Functions();
std::span<const Callback> Callbacks();

const Function* FindFunction(Receiver receiver, std::string_view name);
const Function* FindFunction(std::uint32_t number);
const Callback* FindCallback(Receiver receiver, std::string_view name);
const Callback* FindCallback(std::uint32_t number);

// "a body", "a whole number or a text": a set of types as errors and documents name it.
std::string_view TypeName(tessera_game_type type);

}  // namespace tessera::game
