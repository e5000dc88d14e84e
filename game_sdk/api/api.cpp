#include "game_sdk/api/api.h"

#include <algorithm>

namespace tessera::game {
namespace {

constexpr Parameter kLogParameters[] = {{"text", kTextType, "the line, at most 200 bytes of it"}};
constexpr std::string_view kHitOptions =
    "which bodies are met: `layers`, a layer's name or a list of names; `ignore`, a body or a list of at most 64; "
    "`static` or `dynamic` = false leaves those out; `triggers` = true takes triggers in; `self` = true takes in the "
    "body that the callback is about, which is left out otherwise";
constexpr std::string_view kListOptions =
    "which bodies are met, as for `ray`, and `limit`, how many at most, 1 to 64; without it 16 for `ray_all` and 64 "
    "for "
    "`overlap`";
constexpr std::string_view kShapeDoc =
    "`radius` of a ball; `radius` and `half_height` (of the part between the caps) of a capsule along y; or "
    "`half_extents`, a vector, of a box; each .001 to 1000 m. `rotation` turns it";
constexpr Parameter kRayParameters[] = {{"from", kVectorType, "m in the world"},
                                        {"to", kVectorType, "another point, at most 10 km away"},
                                        {"options", kFieldsType, kHitOptions, true, true}};
constexpr Parameter kRayAllParameters[] = {{"from", kVectorType, "m in the world"},
                                           {"to", kVectorType, "another point, at most 10 km away"},
                                           {"options", kFieldsType, kListOptions, true, true}};
constexpr Parameter kSweepParameters[] = {{"shape", kFieldsType, kShapeDoc, false, true},
                                          {"from", kVectorType, "where the shape's middle begins, m in the world"},
                                          {"to", kVectorType, "where it would end, at most 10 km away"},
                                          {"options", kFieldsType, kHitOptions, true, true}};
constexpr Parameter kOverlapParameters[] = {{"shape", kFieldsType, kShapeDoc, false, true},
                                            {"at", kVectorType, "where the shape's middle is, m in the world"},
                                            {"options", kFieldsType, kListOptions, true, true}};
constexpr Parameter kNameParameters[] = {{"name", kTextType, "a property that the scene declares"}};
constexpr Parameter kSetParameters[] = {{"name", kTextType, "a property that the scene declares"},
                                        {"value", kPropertyType, "of the property's type"}};
constexpr Parameter kImpulseParameters[] = {
    {"impulse", kVectorType, "N s"},
    {"point", kVectorType, "where it acts, m in the world; without it at the centre of mass", true}};
constexpr Parameter kVelocityParameters[] = {{"velocity", kVectorType, "of the centre of mass, m/s"}};
constexpr Parameter kAfterParameters[] = {{"ticks", kWholeType, "from now until the timer is due, 1 to 1 000 000"},
                                          {"name", kTextType, "what on_timer is told, at most 32 bytes"},
                                          {"values", kFieldsType, "what on_timer gets, at most 256 bytes", true}};
constexpr Parameter kSpawnParameters[] = {
    {"prefab", kTextType, "the name of one of the scene's prefabs"},
    {"position", kVectorType, "where its origin shall be, m in the world"},
    {"options", kFieldsType,
     "`rotation`, `velocity` in m/s and `spin` in rad/s of the place, `expire_after` in ticks; each may be left out",
     true}};
constexpr Parameter kExpireParameters[] = {
    {"ticks", kWholeType, "from now until the body is removed, 1 to 1 000 000; 0: it stays"}};
constexpr Parameter kMemberParameters[] = {{"number", kWholeType, "of the prefab's bodies, from 1"}};
constexpr Parameter kCancelParameters[] = {{"timer", kWholeType, "as `after` returned it"}};

constexpr Function kFunctions[] = {
    {kWorldTick, Receiver::kWorld, "tick", {}, kWholeType, "Number of the tick that is being made; the first is 1."},
    {kWorldTickRate, Receiver::kWorld, "tick_rate", {}, kRealType, "Ticks in a second of the world."},
    {kWorldRandom,
     Receiver::kWorld,
     "random",
     {},
     kRealType,
     "A number from 0 to below 1. It follows from the world, the body that the callback is about or else the region, "
     "the tick and how "
     "often "
     "the callback has asked, so it is the same in each run."},
    {kWorldLog, Receiver::kWorld, "log", kLogParameters, kNothingType,
     "Writes a line with tick and body to the log, a few of them a second."},
    {kWorldSpawn, Receiver::kWorld, "spawn", kSpawnParameters, kBodyType,
     "Makes a prefab, owned by this region until it is handed over, and returns its first body. All of its bodies are "
     "there from the next tick on, and their properties may be set at once."},
    {kWorldRay, Receiver::kWorld, "ray", kRayParameters, kFieldsType | kNothingType,
     "The first body that a ray meets, of those that this region sees: `body`, `point` and `normal` of its surface, "
     "`fraction` of the ray before it and `distance` in m; nothing if there is none. A ray that begins inside of a "
     "body "
     "meets it at once; a mesh and a height field have no inside. Bodies are where the last tick left them. The more a "
     "query meets, the more instructions it costs; a short ray takes some hundred."},
    {kWorldRayAll, Receiver::kWorld, "ray_all", kRayAllParameters, kListType,
     "The bodies that a ray meets, each once, as a list of what `ray` returns, nearest first; of equally near ones the "
     "one with the lower id first."},
    {kWorldSweep, Receiver::kWorld, "sweep", kSweepParameters, kFieldsType | kNothingType,
     "What a shape that moves straight, without turning, meets first: as `ray` returns it, with the point where they "
     "touch. A shape that overlaps a body from the beginning has fraction 0, and `from` as the point."},
    {kWorldOverlap, Receiver::kWorld, "overlap", kOverlapParameters, kListType,
     "The bodies that this region sees which have a point in common with a shape, as a list, by id."},
    {kBodyIsHere,
     Receiver::kBody,
     "is_here",
     {},
     kFlagType,
     "Whether this region sees the body: it owns it, or has it as a neighbour's."},
    {kBodyIsOwn,
     Receiver::kBody,
     "is_own",
     {},
     kFlagType,
     "Whether this region owns the body, so that its properties may be set from here."},
    {kBodyKind, Receiver::kBody, "kind", {}, kTextType, "The kind that the scene gives the body; empty without one."},
    {kBodyPosition, Receiver::kBody, "position", {}, kVectorType, "Its centre of mass, m in the world."},
    {kBodyRotation, Receiver::kBody, "rotation", {}, kRotationType, "From the body's axes to the world's."},
    {kBodyVelocity, Receiver::kBody, "velocity", {}, kVectorType, "Of its centre of mass, m/s."},
    {kBodySpin, Receiver::kBody, "spin", {}, kVectorType, "Its angular velocity, rad/s about the axes of the world."},
    {kBodyMass, Receiver::kBody, "mass", {}, kRealType, "kg; 0 for a body that does not move."},
    {kBodyPlayer, Receiver::kBody, "player", {}, kPlayerType | kNothingType, "The player whose body this is, if any."},
    {kBodyGet, Receiver::kBody, "get", kNameParameters, kPropertyType,
     "The value of a property of a body that this region owns, or of one that does not move."},
    {kBodySet, Receiver::kBody, "set", kSetParameters, kNothingType,
     "Sets a property of a body that this region owns. All clients that see the body see it."},
    {kBodyImpulse, Receiver::kBody, "impulse", kImpulseParameters, kNothingType,
     "Pushes a body that this region owns in the next tick."},
    {kBodySetVelocity, Receiver::kBody, "set_velocity", kVelocityParameters, kNothingType,
     "Pushes a body that this region owns so that it has this velocity in the next tick, but for what gravity and "
     "contacts do."},
    {kBodyAfter, Receiver::kBody, "after", kAfterParameters, kWholeType,
     "Has on_timer called for a body that this region owns, wherever the body is then. Returns the timer's number, "
     "which "
     "no other timer of the body had before it."},
    {kBodyCancel, Receiver::kBody, "cancel", kCancelParameters, kFlagType,
     "Takes a timer back. False if it was due already, or never was."},
    {kBodyRemove,
     Receiver::kBody,
     "remove",
     {},
     kNothingType,
     "Removes a body that this region owns, for good. Of a prefab with several bodies only this one goes. Bodies that "
     "do "
     "not move and those of players stay."},
    {kBodyExpireAfter, Receiver::kBody, "expire_after", kExpireParameters, kNothingType,
     "Removes a body that this region owns after so many ticks, wherever it is then."},
    {kBodyMember, Receiver::kBody, "member", kMemberParameters, kBodyType | kNothingType,
     "Another body of the same prefab, if there was one with that number. It may be gone."},
};

constexpr Parameter kContactParameters[] = {{"other", kBodyType, "what it touches"}};
constexpr Parameter kEnterParameters[] = {{"other", kBodyType, "what overlaps the trigger"}};
constexpr Parameter kTimerParameters[] = {{"name", kTextType, "as given to `after`"},
                                          {"values", kFieldsType, "as given to `after`"}};

constexpr Callback kCallbacks[] = {
    {kOnTick, Receiver::kWorld, "on_tick", {}, "Once a tick in each region, before the callbacks of bodies."},
    {kOnBodyTick, Receiver::kBody, "on_tick", {}, "Once a tick for each body of this kind."},
    {kOnBodyContact, Receiver::kBody, "on_contact", kContactParameters,
     "The body began to touch another one. Called for each of the two that the region owns which reports the touch: "
     "that of the "
     "body with the lower id."},
    {kOnBodyContactEnded, Receiver::kBody, "on_contact_ended", kContactParameters,
     "The body touches the other one no more; the other may be gone."},
    {kOnBodyEntered, Receiver::kBody, "on_entered", kEnterParameters, "For triggers: a body came to overlap it."},
    {kOnBodyLeft, Receiver::kBody, "on_left", kEnterParameters,
     "For triggers: a body overlaps it no more; it may be gone."},
    {kOnBodyTimer, Receiver::kBody, "on_timer", kTimerParameters, "A timer of the body is due."},
};

template <class Entry>
const Entry* Named(std::span<const Entry> entries, Receiver receiver, std::string_view name) {
  const auto found = std::ranges::find_if(
      entries, [&](const Entry& entry) { return entry.receiver == receiver && entry.name == name; });
  return found == entries.end() ? nullptr : &*found;
}

template <class Entry>
const Entry* Numbered(std::span<const Entry> entries, std::uint32_t number) {
  const auto found = std::ranges::lower_bound(entries, number, {}, &Entry::number);
  return found == entries.end() || found->number != number ? nullptr : &*found;
}

}  // namespace

std::span<const Function> Functions() { return kFunctions; }
std::span<const Callback> Callbacks() { return kCallbacks; }

const Function* FindFunction(Receiver receiver, std::string_view name) { return Named(Functions(), receiver, name); }
const Function* FindFunction(std::uint32_t number) { return Numbered(Functions(), number); }
const Callback* FindCallback(Receiver receiver, std::string_view name) { return Named(Callbacks(), receiver, name); }
const Callback* FindCallback(std::uint32_t number) { return Numbered(Callbacks(), number); }

std::string_view TypeName(tessera_game_type type) {
  switch (type) {
    case TESSERA_GAME_NOTHING:
      return "nothing";
    case TESSERA_GAME_FLAG:
      return "true or false";
    case TESSERA_GAME_WHOLE:
      return "a whole number";
    case TESSERA_GAME_REAL:
      return "a number";
    case TESSERA_GAME_TEXT:
      return "a text";
    case TESSERA_GAME_VECTOR:
      return "a vector";
    case TESSERA_GAME_ROTATION:
      return "a rotation";
    case TESSERA_GAME_BODY:
      return "a body";
    case TESSERA_GAME_PLAYER:
      return "a player";
    case TESSERA_GAME_INSTANCE:
      return "the world";
    case TESSERA_GAME_LIST:
      return "a list";
    case TESSERA_GAME_FIELDS:
      return "a table of named values";
  }
  return "an unknown type";
}

}  // namespace tessera::game
