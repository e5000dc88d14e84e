// ThrowStage: a world in this process whose player throws balls, over a network as bad as asked, in virtual time. For
// tests, and for the figure of predicted spawns that `./dev bench sdk` has.
//
//   ThrowStage stage({.delay = std::chrono::milliseconds(50)});   // 100 ms there and back
//   if (!stage.Begin()) ...
//   stage.Throw({6, 2, 0});
//   stage.Run(1);
//   for (const double off_m : stage.jumps()) ...
//
// It waits for datagrams of this machine's loopback, never a clock. Thread rule: one thread.
#pragma once

#include <algorithm>
#include <chrono>
#include <cmath>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "absl/strings/str_cat.h"
#include "client_sdk/client.h"
#include "client_sdk/local/local_world.h"
#include "core/world/spawned_id.h"

namespace tessera::client {

class ThrowStage {
 public:
  explicit ThrowStage(const NetworkConditions& network, std::string game = kGame)
      : network_(network), game_(std::move(game)) {}

  // The hand, m from the own body.
  static constexpr Vec3d kHand{0, 0.9, 0};
  // "throw X Y Z" makes a ball, "waste X Y Z" none, "late X Y Z" one that nobody waits for.
  static constexpr const char* kGame = R"lua(
function on_command(player, command)
  local words = string.split(command, " ")
  if words[1] == "waste" then return end
  local velocity = vec(tonumber(words[2]), tonumber(words[3]), tonumber(words[4]))
  local options = { velocity = velocity, expire_after = 240 }
  if words[1] == "throw" then options.predicted = player end
  world.spawn("ball", player:body():position() + vec(0, 0.9, 0), options)
end)lua";

  // --- Set before Begin.
  // The scene's rules for its player: here one that forces roll about.
  std::string player =
      "player { body { mass: 2 shape { sphere { radius: 0.5 } } } spawn_points { y: 0.5 } max_force: 40 max_speed: 5 }";
  const tessera_movement* movement = nullptr;  // that the world and the client have; null: none
  bool crates = true;                          // about the player, that balls bounce off
  // The steering in the frame of this number, from 0 on; none: the player is pushed about.
  std::function<Steering(int frame)> steers{};
  std::function<void(const ClientEvent&)> hears{};  // each event of the client

  // Until the client plays and predicts: false where it does not within ten seconds of the world's time.
  bool Begin() {
    auto opened = local::LocalWorld::Open({.scene = Scene(), .game = game_, .movement = movement});
    if (!opened.ok()) return Fail(opened.status());
    world = *std::move(opened);
    const auto grant = world->Grant();
    if (!grant.ok()) return Fail(grant.status());
    GrantOptions options;
    options.bind_address = "127.0.0.1";
    options.network = network_;
    options.predict = true;
    options.packed_scene = world->packed_scene();
    auto joined = Client::JoinByGrant(*grant, options);
    if (!joined.ok()) return Fail(joined.status());
    client = *std::move(joined);
    if (absl::Status status = client->SetMovement(movement); !status.ok()) return Fail(status);
    // Walking for a while, so that the clock of inputs has found its pace.
    for (int frame = 0; frame < 600; ++frame) {
      if (!steers) client->Move({frame % 120 < 60 ? 20.0F : -20.0F, 0, 0}, {});
      if (!Frame()) return false;
      if (frame > 240 && client->Stats().predicting) return true;
    }
    return Fail(absl::DeadlineExceededError("the client does not predict"));
  }

  // A sixtieth of a second.
  bool Frame() {
    now += std::chrono::nanoseconds(1'000'000'000 / 60);
    if (steers) client->Steer(steers(frame_++));
    if (absl::Status status = world->Advance(now); !status.ok()) return Fail(status);
    while (const auto line = world->TakeLine()) lines.push_back(line->text);
    for (const ClientEvent& event : client->Poll(now)) Take(event);
    if (!looks) return true;
    shown = client->Interpolated(now);
    if (begun_) Check();
    return true;
  }
  bool Run(double seconds) {
    for (int i = 0; i < static_cast<int>(seconds * 60); ++i) {
      if (!Frame()) return false;
    }
    return true;
  }

  absl::StatusOr<BodyId> Throw(Vec3d velocity, const std::string& what = "throw") {
    begun_ = true;
    const std::string command = absl::StrCat(what, " ", velocity.x, " ", velocity.y, " ", velocity.z);
    SpawnAsk ask{.prefab = "ball", .from_own = true};
    ask.motion.position = kHand;
    ask.motion.velocity_m_s = velocity;
    const auto id = client->PredictSpawn(ask, command);
    if (id.ok()) balls_.push_back({*id, *id});
    return id;
  }
  // The throw of this number, of a player who moves: another way, speed and rise with each, at the ground, at
  // crates and far.
  absl::StatusOr<BodyId> ThrowNumber(int number) {
    const ShownBody* const own = Find(client->own_body());
    const Vec3d at = own == nullptr ? Vec3d() : own->pose.position;
    const auto push = [](double from_middle, bool up) {
      if (std::abs(from_middle) > 8) up = from_middle < 0;
      return up ? 25.0F : -25.0F;
    };
    if (!steers) client->Move({push(at.x, number % 6 < 3), 0, push(at.z, number % 4 < 2)}, {});
    const double angle = 0.785 * number + 0.1 * (number % 7), speed = 4 + 2.5 * (number % 5);
    return Throw({speed * std::cos(angle), -3.0 + 2.0 * (number % 4), speed * std::sin(angle)});
  }
  const ShownBody* Find(BodyId id) const {
    const auto at = std::ranges::find(shown, id, &ShownBody::id);
    return at == shown.end() ? nullptr : &*at;
  }

  // How far the server's bodies were from those that were shown for them.
  const std::vector<double>& jumps() const { return jumps_; }
  std::size_t taken() const { return jumps_.size(); }
  std::size_t lost() const { return why_lost.size(); }
  // Frames in which a ball that was thrown was not drawn, or drawn twice, or one was drawn that nobody had thrown.
  std::size_t missing() const { return missing_; }
  std::size_t doubled() const { return doubled_; }
  std::string error{};

  std::unique_ptr<local::LocalWorld> world;
  std::unique_ptr<Client> client;
  TimePoint now{std::chrono::hours(1'000'000)};  // far from this machine's clock, so that mixing the two shows
  std::vector<ShownBody> shown;
  std::vector<std::string> lines;  // that the game has printed, and its errors
  std::vector<std::string> why_lost;
  bool looks = true;  // at the picture of each frame

 private:
  struct Ball {
    BodyId thrown, id;  // as it was called first, and as it is called now
  };

  // A floor, the player and, about it, the crates.
  std::string Scene() const {
    std::string scene =
        R"(name: "yard" bounds { min { x: -60 y: -5 z: -60 } max { x: 60 y: 60 z: 60 } } tick_rate_hz: 60
      materials { name: "ground" friction: 0.6 restitution: 0.3 }
      materials { name: "rubber" friction: 0.5 restitution: 0.6 }
      bodies { id: 1 motion: MOTION_STATIC material: "ground" pose { position { y: -0.5 } }
               shape { box { half_extents { x: 60 y: 0.5 z: 60 } } } }
      prefabs { name: "ball" bodies { mass: 0.5 material: "rubber" shape { sphere { radius: 0.15 } } } }
      prefabs { name: "pair" bodies { mass: 1 shape { sphere { radius: 0.1 } } }
                bodies { mass: 1 shape { sphere { radius: 0.1 } } pose { position { x: 1 } } }
                joints { body_a: 1 body_b: 2 fixed {} frame_a { position { x: 1 } } } })";
    absl::StrAppend(&scene, "\n", player);
    for (int i = 0; crates && i < 8; ++i) {
      const double angle = i * 0.785;
      absl::StrAppend(&scene, "\nbodies { id: ", 10 + i, " mass: 20 pose { position { x: ", 4 * std::cos(angle),
                      " y: 0.5 z: ", 4 * std::sin(angle),
                      " } } shape { box { half_extents { x: 0.5 y: 0.5 z: 0.5 } } } }");
    }
    return scene;
  }
  bool Fail(const absl::Status& status) {
    error = std::string(status.message());
    return false;
  }
  void Take(const ClientEvent& event) {
    if (hears) hears(event);
    if (event.kind == ClientEvent::Kind::kSpawnTaken) {
      jumps_.push_back(event.off_m);
      for (Ball& ball : balls_) {
        if (ball.id == event.other) ball.id = event.body;
      }
    }
    const bool gone = event.kind == ClientEvent::Kind::kSpawnLost || event.kind == ClientEvent::Kind::kVanished;
    if (event.kind == ClientEvent::Kind::kSpawnLost) why_lost.push_back(event.detail);
    if (gone) std::erase_if(balls_, [&](const Ball& ball) { return ball.id == event.body; });
  }
  void Check() {
    std::size_t drawn = 0;
    for (const ShownBody& body : shown) drawn += IsSpawned(body.id) ? 1 : 0;
    for (const Ball& ball : balls_) missing_ += Find(ball.id) == nullptr ? 1 : 0;
    doubled_ += drawn > balls_.size() ? 1 : 0;
  }

  NetworkConditions network_;
  std::string game_;
  int frame_ = 0;
  bool begun_ = false;
  std::vector<Ball> balls_;
  std::vector<double> jumps_;
  std::size_t missing_ = 0, doubled_ = 0;
};

}  // namespace tessera::client
