#include "game_sdk/api/api.h"

#include "game_sdk/api/by_number.h"

namespace tessera::game {
namespace {

constexpr Parameter kLogParameters[] = {{"text", kTextType, "the line, at most 200 bytes of it"}};
constexpr std::string_view kHitOptions =
    "which bodies are met: `layers` and `kinds`, a name or a list of names; `property` and `value`: those whose "
    "property "
    "has this value; `ignore`, a body or a list of at most 64; "
    "`static` or `dynamic` = false leaves those out; `triggers` = true takes triggers in; `self` = true takes in the "
    "body that the callback is about, which is left out otherwise; `at_time`, a tick and a part of one, up to .4 s "
    "ago, "
    "as `shown_time` of a player gives it: bodies are met where they were then";
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
constexpr std::string_view kAskOptions =
    "which bodies are met, as for `ray`, and `limit`, how many at most, 1 to 64; without it 1 for rays and sweeps and "
    "64 "
    "for overlaps";
constexpr std::string_view kAskNameDoc = "what on_answer is told, 1 to 32 bytes";
constexpr std::string_view kAskValuesDoc = "what on_answer gets, at most 256 bytes";
constexpr Parameter kAskRayParameters[] = {{"name", kTextType, kAskNameDoc},
                                           {"from", kVectorType, "m in the world"},
                                           {"to", kVectorType, "another point, at most 10 km away"},
                                           {"options", kFieldsType, kAskOptions, true, true},
                                           {"values", kFieldsType, kAskValuesDoc, true}};
constexpr Parameter kAskSweepParameters[] = {{"name", kTextType, kAskNameDoc},
                                             {"shape", kFieldsType, kShapeDoc, false, true},
                                             {"from", kVectorType, "where the shape's middle begins, m in the world"},
                                             {"to", kVectorType, "where it would end, at most 10 km away"},
                                             {"options", kFieldsType, kAskOptions, true, true},
                                             {"values", kFieldsType, kAskValuesDoc, true}};
constexpr Parameter kAskOverlapParameters[] = {{"name", kTextType, kAskNameDoc},
                                               {"shape", kFieldsType, kShapeDoc, false, true},
                                               {"at", kVectorType, "where the shape's middle is, m in the world"},
                                               {"options", kFieldsType, kAskOptions, true, true},
                                               {"values", kFieldsType, kAskValuesDoc, true}};
constexpr Parameter kNameParameters[] = {{"name", kTextType, "a property that the scene declares"}};
constexpr Parameter kSetParameters[] = {
    {"name", kTextType, "a property that the scene declares"},
    {"value", kPropertyType, "of the property's type; nothing for no body, a text for bytes"}};
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
     "`rotation`, `velocity` in m/s and `spin` in rad/s of the place, `expire_after` in ticks, `predicted`: within "
     "on_command its player, whose client may show the body already; each may be left out",
     true}};
constexpr Parameter kExpireParameters[] = {
    {"ticks", kWholeType, "from now until the body is removed, 1 to 1 000 000; 0: it stays"}};
constexpr Parameter kMemberParameters[] = {{"number", kWholeType, "of the prefab's bodies, from 1"}};
constexpr Parameter kCountParameters[] = {{"name", kTextType, "of the counter: a-z, 0-9 and _, at most 64 of them"},
                                          {"more", kWholeType, "0 to 1 000 000; without it 1", true}};
constexpr Parameter kCancelParameters[] = {{"timer", kWholeType, "as `after` returned it"}};

constexpr Parameter kPushForParameters[] = {
    {"ticks", kWholeType, "for how long, 1 to 36 000"},
    {"force", kVectorType, "N, in the axes of the world"},
    {"torque", kVectorType, "N m, in the axes of the world; without it none", true}};
constexpr Parameter kCancelPushParameters[] = {{"push", kWholeType, "as `push_for` returned it"}};
constexpr Parameter kSpinParameters[] = {{"spin", kVectorType, "rad/s in the axes of the world, up to 1000"}};
constexpr Parameter kTeleportParameters[] = {
    {"position", kVectorType, "of its centre of mass, m in the world, inside of the scene's bounds"},
    {"rotation", kRotationType, "from the body's axes to the world's; without it the body is not turned", true},
    {"options", kFieldsType, "`velocity` in m/s and `spin` in rad/s; what is left out stays as it is", true, true}};
constexpr Parameter kGravityParameters[] = {
    {"factor", kRealType, "of the scene's gravity, -10 to 10; 0: it floats, 1: as the scene has it for most bodies"}};
constexpr Parameter kMaterialParameters[] = {
    {"material", kFieldsType, "`friction`, 0 to 10, and `restitution`, 0 to 1; what is left out stays as it is", false,
     true}};
constexpr Parameter kMoveToParameters[] = {
    {"position", kVectorType, "of its centre of mass, m in the world, inside of the scene's bounds"},
    {"rotation", kRotationType | kNothingType, "from the body's axes to the world's; nothing: it is not turned"},
    {"ticks", kWholeType, "from now until it is there, 1 to 36 000"}};
constexpr Parameter kShowToParameters[] = {
    {"who", kTextType,
     "\"everyone\", \"team\": the players of the body's team, by the scene's `team_property`, or \"servers\": nobody"}};
constexpr Parameter kConnectParameters[] = {
    {"other", kBodyType, "at most 20 m away"},
    {"joint", kFieldsType,
     "`kind`: \"ball\" (without it), \"fixed\", \"hinge\", \"slider\", \"spring\" or \"distance\". `at`: where it is, "
     "m in the "
     "world; without it the other body's place. `axis`, a vector, and `lower` and `upper`, rad or m from now, of a "
     "hinge or slider. A spring (`stiffness` in N/m, `damping` in N s/m) and a distance (`length` in m, along each of "
     "the body's axes) hold the point `at` of this body and `at_other` of the other one, without them the bodies' "
     "places. `collide` = true: the two still touch. `answer`: the name of a message that tells whether it was made",
     true, true}};
constexpr Parameter kConnectedParameters[] = {{"other", kBodyType, "the other body"}};
constexpr Parameter kWorldNameParameters[] = {{"name", kTextType, "one of the scene's `instance_properties`"}};
constexpr Parameter kWorldSetParameters[] = {
    {"name", kTextType, "one of the scene's `instance_properties`"},
    {"value", kPropertyType, "of the property's type; nothing for no body, a text for bytes"}};
constexpr Parameter kSendParameters[] = {{"name", kTextType, "what on_message is told, 1 to 32 bytes"},
                                         {"values", kFieldsType, "what on_message gets, at most 512 bytes", true}};
constexpr Parameter kPublishParameters[] = {
    {"name", kTextType, "what the backend gets as the event's name, 1 to 32 bytes"},
    {"values", kFieldsType, "what the backend gets with it, at most 512 bytes", true}};
constexpr Parameter kReasonParameters[] = {
    {"reason", kTextType, "what the player is told, at most 200 bytes without control characters"}};
constexpr Parameter kEventParameters[] = {
    {"name", kTextType, "what the client gets as the event's name, 1 to 32 bytes"},
    {"values", kFieldsType, "what the client gets with it, at most 256 bytes", true}};
constexpr Parameter kPlaceParameters[] = {
    {"position", kVectorType, "m in the world"},
    {"rotation", kRotationType, "from the body's axes to the world's; without it as it is", true}};
constexpr Parameter kControlParameters[] = {
    {"body", kBodyType | kNothingType, "one that moves and is no player's own; nothing: the player looks on", true}};
constexpr Parameter kLimitsParameters[] = {
    {"limits", kFieldsType,
     "`force` in N, `torque` in N m and `speed` in m/s, and `axes`, a vector with the share of the force along each "
     "axis of the world, 0 to 1; what is left out is as the scene has it",
     false, true}};
constexpr Parameter kExplodeParameters[] = {
    {"blast", kFieldsType,
     "`at`, m in the world; `radius`, up to 200 m; `impulse`, N s, away from there, or towards it if below 0; "
     "`falloff`: \"linear\" to nothing at the radius (without it), \"square\" or \"none\"; `speed`, m/s: no body "
     "gets faster by more than that, with the same falloff; `lift`, 0 to 1: how much the way leads up as well; "
     "`layers`, a name or a list of names; `name`, at most 32 bytes, which on_blast is told",
     false, true}};
constexpr Parameter kPointParameters[] = {{"point", kVectorType, "m in the world"}};

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
     "there from the next tick on, and their properties may be set at once. A place inside a static body that one of "
     "them collides with is refused; a mesh and a height field have no inside."},
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
    {kWorldAskRay, Receiver::kWorld, "ask_ray", kAskRayParameters, kNothingType,
     "Asks all regions that a ray touches what it meets, as bodies are in this tick or at `at_time`. The body that the "
     "callback is about gets the answer with on_answer, wherever it is then, 2 ticks later, or 8 and 4 more for each "
     "further border where the ray leaves the region; else the world does, whose record this region must own. A body "
     "has at most 8 questions at once."},
    {kWorldAskSweep, Receiver::kWorld, "ask_sweep", kAskSweepParameters, kNothingType,
     "The same for a shape that moves straight, without turning."},
    {kWorldAskOverlap, Receiver::kWorld, "ask_overlap", kAskOverlapParameters, kNothingType,
     "The same for a shape that stands: all bodies with a point in common with it, by id."},
    {kWorldExplode, Receiver::kWorld, "explode", kExplodeParameters, kNothingType,
     "Pushes all bodies away from a place once, in whatever regions they are: as they are 4 ticks after the call, or 2 "
     "more for each border beyond the first, and from the tick after that on. A region that was cut off acts within 10 "
     "seconds of then, as soon as it hears of it; each body is pushed once, whoever owns it, or not at all. Wakes "
     "sleepers; static and kinematic bodies, and those of who looks on, stay. A region keeps 256 of the last 10 "
     "seconds, and more fail."},
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
     "Whether this region owns the body, so that changes of it act at once."},
    {kBodyKind, Receiver::kBody, "kind", {}, kTextType, "The kind that the scene gives the body; empty without one."},
    {kBodyPosition, Receiver::kBody, "position", {}, kVectorType, "Its centre of mass, m in the world."},
    {kBodyRotation, Receiver::kBody, "rotation", {}, kRotationType, "From the body's axes to the world's."},
    {kBodyVelocity, Receiver::kBody, "velocity", {}, kVectorType, "Of its centre of mass, m/s."},
    {kBodySpin, Receiver::kBody, "spin", {}, kVectorType, "Its angular velocity, rad/s about the axes of the world."},
    {kBodyMass, Receiver::kBody, "mass", {}, kRealType, "kg; 0 for a body that does not move."},
    {kBodyPlayer, Receiver::kBody, "player", {}, kPlayerType | kNothingType, "The player whose body this is, if any."},
    {kBodyGet, Receiver::kBody, "get", kNameParameters, kPropertyType,
     "The value of a property. A body that another region owns has the values of four ticks ago, or older ones while a "
     "region's copy is behind."},
    {kBodySet, Receiver::kBody, "set", kSetParameters, kNothingType,
     "Sets a property of a body. All clients that see the body see it. One of another region is set some ticks later."},
    {kBodyImpulse, Receiver::kBody, "impulse", kImpulseParameters, kNothingType,
     "Pushes a body in the next tick, one of another region some ticks later."},
    {kBodySetVelocity, Receiver::kBody, "set_velocity", kVelocityParameters, kNothingType,
     "Pushes a body so that it has this velocity in the next tick, but for what gravity and contacts do; one of "
     "another region some ticks later."},
    {kBodyAfter, Receiver::kBody, "after", kAfterParameters, kWholeType | kNothingType,
     "Has on_timer called for a body, wherever the body is then. Returns the timer's number, which no other timer of "
     "the body had before it; nothing for a body of another region, whose ticks count from when it hears of it."},
    {kBodyCancel, Receiver::kBody, "cancel", kCancelParameters, kFlagType,
     "Takes a timer back. False if it was due already, or never was."},
    {kBodyRemove,
     Receiver::kBody,
     "remove",
     {},
     kNothingType,
     "Removes a body for good, one of another region some ticks later. Of a prefab with several bodies only this one "
     "goes. Bodies that do not move and those of players stay."},
    {kBodyExpireAfter, Receiver::kBody, "expire_after", kExpireParameters, kNothingType,
     "Removes a body after so many ticks, wherever it is then; for one of another region they count from when it hears "
     "of it."},
    {kBodyMember, Receiver::kBody, "member", kMemberParameters, kBodyType | kNothingType,
     "Another body of the same prefab, if there was one with that number. It may be gone."},
    {kWorldGet, Receiver::kWorld, "get", kWorldNameParameters, kPropertyType,
     "The value of a property of the world; `world.name` is the same. Where another region owns the world's record, as "
     "it was a few ticks ago."},
    {kWorldSet, Receiver::kWorld, "set", kWorldSetParameters, kNothingType,
     "Sets a property of the world; `world.name = value` is the same. Fails where another region owns the world's "
     "record: send the world a message."},
    {kWorldAfter, Receiver::kWorld, "after", kAfterParameters, kWholeType,
     "Has on_timer of the world called, in the region that owns the world's record then. Fails where another region "
     "owns it."},
    {kWorldCancel, Receiver::kWorld, "cancel", kCancelParameters, kFlagType,
     "Takes a timer of the world back. False if it was due already, or never was."},
    {kWorldSend, Receiver::kWorld, "send", kSendParameters, kNothingType,
     "Sends a message to the world: on_message of the world gets it, once, in the region that owns the world's "
     "record."},
    {kWorldIsOwn,
     Receiver::kWorld,
     "is_own",
     {},
     kFlagType,
     "Whether this region owns the world's record, so that its properties may be set and its timers changed from "
     "here."},
    {kWorldPublish, Receiver::kWorld, "publish", kPublishParameters, kNothingType,
     "Gives the game's backend an event, which gets each once, and those of one body in order. It goes as a message to "
     "the world does, and fails when that would."},
    {kWorldPlayers,
     Receiver::kWorld,
     "players",
     {},
     kListType,
     "The players whose bodies this region owns, as a list, by their numbers."},
    {kWorldBroadcast, Receiver::kWorld, "broadcast", kEventParameters, kWholeType,
     "Sends an event to each player whose body this region owns, as `send` does, and returns to how many. Who has too "
     "many events waiting is left out."},
    {kWorldTime,
     Receiver::kWorld,
     "time",
     {},
     kRealType,
     "Seconds of the world since it began: ticks times the length of a tick. It stands while the world is paused."},
    {kWorldCount, Receiver::kWorld, "count", kCountParameters, kNothingType,
     "Adds to a counter of the game's own, which operators see as the metric tessera_game_counter_total. A game has at "
     "most 32 of them; a game cannot read them."},
    {kBodySend, Receiver::kBody, "send", kSendParameters, kNothingType,
     "Sends a message to a body, wherever it is: its on_message gets it once, and after those that were sent to it "
     "from here before. It is dropped if the body is gone."},
    {kBodyPushFor, Receiver::kBody, "push_for", kPushForParameters, kWholeType | kNothingType,
     "Pushes a body in each of the next ticks, wherever it is then; at most 4 such pushes at "
     "once. Returns the push's number, which no other of the body had before it."},
    {kBodyCancelPush, Receiver::kBody, "cancel_push", kCancelPushParameters, kFlagType,
     "Takes a push back. False if it had ended already, or never was."},
    {kBodySetSpin, Receiver::kBody, "set_spin", kSpinParameters, kNothingType,
     "Turns a body so that it has this angular velocity in the next tick, but for what contacts "
     "do."},
    {kBodyTeleport, Receiver::kBody, "teleport", kTeleportParameters, kNothingType,
     "Puts a body elsewhere, together with all that joints connect to it. It is there in the "
     "next tick, or, where a neighbour has to hear of it, up to two ticks later; the owner of the place gets it then. "
     "Its contacts end, and clients show no way from here to there. A body that joints hold to the world stays."},
    {kBodyWake,
     Receiver::kBody,
     "wake",
     {},
     kNothingType,
     "Wakes a body in the next tick, and with it all that it touches."},
    {kBodySetGravity, Receiver::kBody, "set_gravity", kGravityParameters, kNothingType,
     "From the next tick on, gravity pulls a body by so much of the scene's, and wakes it."},
    {kBodySetMaterial, Receiver::kBody, "set_material", kMaterialParameters, kNothingType,
     "From the next tick on, a body has this friction and restitution. Wakes it."},
    {kBodyMoveTo, Receiver::kBody, "move_to", kMoveToParameters, kNothingType,
     "Moves a kinematic body that the scene gives no path: straight, at an even pace, so "
     "that it is there after so many ticks, whatever is in its way. Another call takes the place of the one before. At "
     "most 100 m/s."},
    {kBodyConnect, Receiver::kBody, "connect", kConnectParameters, kNothingType,
     "Makes a joint between two bodies that this region sees. They are one from then on, and are handed over together. "
     "Where regions own one each, it is made when they have met, or given up after a second; whoever asked gets the "
     "message `answer` with `connected`, the two as `body` and `other`, and a `reason` if not. A body has at most 8 "
     "joints to bodies with higher ids, 32 bodies hang together at most, and one player's among them. A removed body "
     "takes its joints with it."},
    {kBodyDisconnect, Receiver::kBody, "disconnect", kConnectedParameters, kFlagType | kNothingType,
     "Ends the joint that `connect` made between the two. False if there was none; nothing where another region "
     "decides, some ticks later."},
    {kBodyIsConnected, Receiver::kBody, "is_connected", kConnectedParameters, kFlagType,
     "Whether a joint between the two is in force, be it the scene's or one that `connect` made."},
    {kBodyShowTo, Receiver::kBody, "show_to", kShowToParameters, kNothingType,
     "Says which clients see a body from now on. Who sees it no more forgets it at once, whatever it does; its own "
     "player always sees it."},
    {kBodyController,
     Receiver::kBody,
     "controller",
     {},
     kPlayerType | kNothingType,
     "The player whose inputs move a body that this region owns."},
    {kPlayerName,
     Receiver::kPlayer,
     "name",
     {},
     kTextType,
     "The name that the player joined with; it may be empty, and others may have the same. The region owns the "
     "player's body."},
    {kPlayerBody,
     Receiver::kPlayer,
     "body",
     {},
     kBodyType,
     "The player's own body, which is there as long as the player is, also while the player spectates."},
    {kPlayerIsOwn,
     Receiver::kPlayer,
     "is_own",
     {},
     kFlagType,
     "Whether this region owns the player's body, as the functions below require but where they say otherwise."},
    {kPlayerRefuse, Receiver::kPlayer, "refuse", kReasonParameters, kNothingType,
     "Only within on_join: does not let the player in. Nobody ever sees the body, on_leave is not called, and the "
     "client ends with the reason."},
    {kPlayerKick, Receiver::kPlayer, "kick", kReasonParameters, kNothingType,
     "Ends the player's session: the client ends with the reason, the body takes no part any more, and on_leave is "
     "called once the control plane has stored that the player left."},
    {kPlayerSend, Receiver::kPlayer, "send", kEventParameters, kNothingType,
     "Sends an event to the player's client, which gets all events once and in order, whatever regions the player "
     "passes through and whichever die. They wait with the player until the client has them; it fails when 64, or "
     "16 KiB, wait already."},
    {kPlayerPlace, Receiver::kPlayer, "place", kPlaceParameters, kNothingType,
     "Puts the player's body there at once, standing still. Within on_join nobody has seen it elsewhere."},
    {kPlayerSpectate, Receiver::kPlayer, "spectate", kPointParameters, kNothingType,
     "Takes the player's body out of the world: nobody sees it, nothing touches it, and inputs do nothing. The player "
     "sees what there is about the point, which `place` and another call move."},
    {kPlayerRespawn, Receiver::kPlayer, "respawn", kPlaceParameters, kNothingType,
     "Puts the player's body there, standing still, and back into the world if the player spectates."},
    {kPlayerIsSpectating,
     Receiver::kPlayer,
     "is_spectating",
     {},
     kFlagType,
     "Whether the player looks on: `spectate` was the last word, or control of another body has ended."},
    {kPlayerControl, Receiver::kPlayer, "control", kControlParameters, kNothingType,
     "Asks that the player's inputs move this body from now on, instead of the own one, which stands aside and goes "
     "where the body goes: so it enters a vehicle, and `respawn` leaves it. Two ticks later, or some ten where another "
     "region "
     "owns the body, on_control says whether the player has it: the first who asks gets it. What the player moved "
     "before is let go at once. The body is pushed by the force and torque of inputs within the limits, also where "
     "players are characters; whatever else an input says is the game's to carry out. A body that hangs together with "
     "a player, or with what one moves, is refused. Nothing: the player looks on from where it is."},
    {kPlayerControlled,
     Receiver::kPlayer,
     "controlled",
     {},
     kBodyType | kNothingType,
     "The body that the player's inputs move; nothing while the player looks on."},
    {kPlayerSetLimits, Receiver::kPlayer, "set_limits", kLimitsParameters, kNothingType,
     "Says what the player's inputs may do from now on, whatever body they move; each call replaces the one before. A "
     "character heeds `speed` alone, and gets no faster by it than the scene has it. The client's prediction knows "
     "it."},
    {kPlayerInput,
     Receiver::kPlayer,
     "input",
     {},
     kFieldsType,
     "What the player asked for in this tick: `move`, a vector with the share of full speed to the right as x and "
     "forward as y; `look`, a unit vector of the world; `yaw` and `pitch` in rad; `buttons`, whose bits are those that "
     "are held down. All of it is 0 before the first input."},
    {kPlayerShownTime,
     Receiver::kPlayer,
     "shown_time",
     {},
     kRealType,
     "The moment of the world that the player was shown, a tick and a part of one: within on_command when the command "
     "was given, else when the input of this tick was made. The client says so, and is believed from .4 s ago to now; "
     "one that does not say is taken to see the world as it is. For `at_time` of queries."},
    {kPlayerNumber,
     Receiver::kPlayer,
     "number",
     {},
     kWholeType,
     "The player's number in this world, from 1; no other player ever gets it. Anywhere."},
};

static_assert(std::size(kFunctions) < 256);
constexpr auto kFunctionPlaces = PlacesByNumber<kFunctions>();

}  // namespace

std::span<const Function> Functions() { return kFunctions; }

const Function* FindFunction(Receiver receiver, std::string_view name) { return Named(Functions(), receiver, name); }
const Function* FindFunction(std::uint32_t number) { return Numbered(kFunctions, kFunctionPlaces, number); }

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
