#include "game_sdk/api/api.h"
#include "game_sdk/api/by_number.h"

namespace tessera::game {
namespace {

constexpr Parameter kMigrateParameters[] = {
    {"from", kWholeType, "number of the game that last took the body over, or made it; 0 is the world's first"}};
constexpr Parameter kWorldMigrateParameters[] = {
    {"from", kWholeType, "number of the game that last took the world's record over; 0 is the world's first"}};
constexpr Parameter kContactParameters[] = {
    {"other", kBodyType, "what it touches"},
    {"contact", kFieldsType | kNothingType,
     "`point`, a vector, m in the world; `normal`, a unit vector from the other body towards this one; `impulse`, how "
     "hard they met in that tick, N s"}};
constexpr Parameter kContactEndedParameters[] = {{"other", kBodyType, "what it touched"}};
constexpr Parameter kEnterParameters[] = {{"other", kBodyType, "what overlaps the trigger"}};
constexpr Parameter kTimerParameters[] = {{"name", kTextType, "as given to `after`"},
                                          {"values", kFieldsType, "as given to `after`"}};

constexpr Parameter kMessageParameters[] = {
    {"name", kTextType, "as given to `send`"},
    {"values", kFieldsType, "as given to `send`"},
    {"sender", kBodyType | kNothingType | kTextType,
     "whose callback sent it; nothing: one of the world; the text \"backend\": the game's backend"}};
constexpr Parameter kPlayerParameters[] = {{"player", kPlayerType, "whom it is about; the region owns the body"}};
constexpr Parameter kOnControlParameters[] = {
    {"player", kPlayerType, "whom it is about; the region owns the own body"},
    {"body", kBodyType | kNothingType, "the other body that the player moves; nothing: the player moves none"},
    {"reason", kTextType, "why not; empty where there is a body"}};
constexpr Parameter kBlastParameters[] = {
    {"blast", kFieldsType,
     "`at`; `by`: whose callback asked for it, nothing for the world; `name`, as given to `explode`; `share`: 1 where "
     "nothing has fallen off"}};
constexpr Parameter kCommandParameters[] = {{"player", kPlayerType, "who sent it"},
                                            {"bytes", kTextType, "what the client gave to tessera_send, unchecked"}};

constexpr std::string_view kHitsDoc =
    "what was met, as `ray` returns it, nearest first; of equally near ones the one with the lower id first";
constexpr std::string_view kCompleteDoc =
    "false if a region did not answer within a second, or did not know any more, as after a failover";
constexpr Parameter kWorldAnswerParameters[] = {
    {"name", kTextType, "as given to `ask_ray`"},
    {"hits", kListType, kHitsDoc},
    {"complete", kFlagType, kCompleteDoc},
    {"values", kFieldsType, "as given to `ask_ray`"},
    {"asker", kBodyType | kNothingType, "whom the callback was about that asked; nothing: the world"}};
constexpr Parameter kBodyAnswerParameters[] = {{"name", kTextType, "as given to `ask_ray`"},
                                               {"hits", kListType, kHitsDoc},
                                               {"complete", kFlagType, kCompleteDoc},
                                               {"values", kFieldsType, "as given to `ask_ray`"}};

constexpr Callback kCallbacks[] = {
    {kOnTick, Receiver::kWorld, "on_tick", {}, "Once a tick in each region, before the callbacks of bodies."},
    {kOnWorldTimer, Receiver::kWorld, "on_timer", kTimerParameters,
     "A timer of the world is due. Called in the region that owns the world's record."},
    {kOnWorldMessage, Receiver::kWorld, "on_message", kMessageParameters,
     "A message to the world. Called in the region that owns the world's record."},
    {kOnWorldAnswer, Receiver::kWorld, "on_answer", kWorldAnswerParameters,
     "The answer to a question of the world, or of a body whose kind has no on_answer, such as a player's."},
    {kOnJoin, Receiver::kWorld, "on_join", kPlayerParameters,
     "A player has come: called once, in the tick that makes the player's body, before anybody is shown it."},
    {kOnLeave, Receiver::kWorld, "on_leave", kPlayerParameters,
     "A player goes for good: called once, before the player's body is removed."},
    {kOnCommand, Receiver::kWorld, "on_command", kCommandParameters,
     "A client has sent a command. Each is given once, in the order in which the client sent them, wherever the "
     "player's "
     "body is."},
    {kOnControl, Receiver::kWorld, "on_control", kOnControlParameters,
     "The player moves another body from now on, or gets none: the answer to `control`, or what was moved is gone."},
    {kOnWorldMigrate, Receiver::kWorld, "on_migrate", kWorldMigrateParameters,
     "This game has taken the place of another one while the world runs. Called once, before anything else, in the "
     "region that owns the world's record; the world's properties and timers are as the other game left them. If it "
     "fails they stay so."},
    {kOnBodyMigrate, Receiver::kBody, "on_migrate", kMigrateParameters,
     "This game has taken the place of another one while the world runs. Called once for each body of this kind, "
     "before "
     "anything else of it; its properties and timers are as the other game left them. If it fails they stay so."},
    {kOnBodyTick, Receiver::kBody, "on_tick", {}, "Once a tick for each body of this kind."},
    {kOnBodyContact, Receiver::kBody, "on_contact", kContactParameters,
     "The body began to touch another one. Each of the two is called once, whichever regions own them: in the same "
     "tick "
     "where one region owns both, else the one with the higher id 4 ticks later, by a message of the other one, which "
     "may be out of sight by then. Nothing is told of a body that an earlier callback of the tick removed."},
    {kOnBodyContactEnded, Receiver::kBody, "on_contact_ended", kContactEndedParameters,
     "The body touches the other one no more; the other may be gone."},
    {kOnBodyEntered, Receiver::kBody, "on_entered", kEnterParameters, "For triggers: a body came to overlap it."},
    {kOnBodyLeft, Receiver::kBody, "on_left", kEnterParameters,
     "For triggers: a body overlaps it no more; it may be gone."},
    {kOnBodyTimer, Receiver::kBody, "on_timer", kTimerParameters, "A timer of the body is due."},
    {kOnBodyMessage, Receiver::kBody, "on_message", kMessageParameters, "A message to the body."},
    {kOnBodyAnswer, Receiver::kBody, "on_answer", kBodyAnswerParameters,
     "The answer to a question that a callback of the body has asked, such as `ask_ray`."},
    {kOnBodyBlast, Receiver::kBody, "on_blast", kBlastParameters,
     "An area effect pushes the body. What it got is among what moves it already."},
};

static_assert(std::size(kCallbacks) < 256);
constexpr auto kCallbackPlaces = PlacesByNumber<kCallbacks>();

}  // namespace

std::span<const Callback> Callbacks() { return kCallbacks; }
const Callback* FindCallback(Receiver receiver, std::string_view name) { return Named(Callbacks(), receiver, name); }
const Callback* FindCallback(std::uint32_t number) { return Numbered(kCallbacks, kCallbackPlaces, number); }

}  // namespace tessera::game
