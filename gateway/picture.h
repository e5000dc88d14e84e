// Picture: a world at one moment, quantised once for all who are shown it.
//
// PictureMaker makes one of what a client knows. What does not change about a body (its shape, its name) is looked up
// when the body appears, and has a number: another number means that it has to be sent anew.
//
//   PictureMaker maker(book);
//   const Picture& picture = maker.Make(client, now, now, client.clock().paused);
//
// A picture lasts until the next one. Thread rule: one thread.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "client_sdk/client.h"
#include "core/world/ids.h"
#include "gateway/scene_book.h"

namespace tessera::gateway {

struct Identity {
  std::uint32_t shape = 0;
  std::uint8_t flags = 0;
  PlayerNumber player{};
  std::string name{};
  float mass_kg = 0;
};

struct PictureBody {
  BodyId id;
  const Identity* identity = nullptr;
  std::uint32_t number = 0;                // this identity's, among all of a maker
  std::array<std::int64_t, 3> position{};  // place of the shape's origin, in steps
  std::uint32_t orientation = 0;
  std::uint32_t owner = 0, speed = 0;
  std::uint8_t state = 0;
};

struct Picture {
  Tick tick;
  double time_s = 0;  // the clock that poses were taken by
  bool paused = false;
  std::vector<PictureBody> bodies{};  // ascending by id
};

// As docs/viewer_protocol.md has it: smallest three, 10 bits each.
std::uint32_t PackOrientation(const Quatd& orientation);
std::array<std::int64_t, 3> PackPosition(const Vec3d& position);
std::uint32_t PackSpeed(const Vec3f& velocity);

class PictureMaker {
 public:
  explicit PictureMaker(std::shared_ptr<const SceneBook> book) : book_(std::move(book)) {}
  // Shows the client's moment `now`, which stands if `paused`; `taken_at`: on the clock of those who are shown it.
  const Picture& Make(client::Client& client, client::TimePoint now, client::TimePoint taken_at, bool paused);

 private:
  // All that does not change about a body; each picture needs what stands beside the identity.
  struct Known {
    BodyId id;
    std::uint32_t number = 0, shape = 0;
    bool lacks_name = false;
    std::unique_ptr<const Identity> identity{};  // null: it has no shape of the scene
  };
  // Makes known_ the bodies that are shown, one for one.
  void Follow(const client::Client& client, const std::vector<client::ShownBody>& shown);
  void Identify(const client::Client& client, Known& known);

  std::shared_ptr<const SceneBook> book_;
  Picture picture_;
  std::vector<Known> known_, next_;  // ascending by id
  std::uint32_t last_identity_ = 0;
};

}  // namespace tessera::gateway
