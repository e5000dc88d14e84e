#include "world.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <vector>

namespace desktop {
namespace {

constexpr Vec3 kOwnColour = {0.86F, 0.66F, 0.16F}, kGroundColour = {0.44F, 0.46F, 0.45F},
               kWallColour = {0.62F, 0.60F, 0.56F};
constexpr Vec3 kAsleepColour = {0.45F, 0.47F, 0.50F};
constexpr float kAsleepShare = 0.45F;
constexpr float kOwnerShare = 0.5F;  // in the colour of a body that has its own
constexpr double kEyeAbove_m = 1.0;  // the camera looks at a point so far above the own body's middle
constexpr float kFollow_s = 0.12F;   // the camera comes after it within about so long
constexpr double kArrived_m = 0.01;
constexpr float kBehind_m = 30;  // bodies so far behind the eye cast no shadow into the picture
constexpr double kNearestEnd_m = 150, kFurthestEnd_m = 2500;

Vec3 Mix(Vec3 a, Vec3 b, float share) { return a * (1 - share) + b * share; }

}  // namespace

Vec3 ColourOf(std::uint32_t region) {
  static constexpr std::array<Vec3, 8> kColours = {{{0.25F, 0.52F, 0.90F},
                                                    {0.93F, 0.45F, 0.30F},
                                                    {0.33F, 0.72F, 0.42F},
                                                    {0.66F, 0.45F, 0.85F},
                                                    {0.20F, 0.72F, 0.75F},
                                                    {0.90F, 0.40F, 0.62F},
                                                    {0.62F, 0.68F, 0.25F},
                                                    {0.70F, 0.52F, 0.38F}}};
  return region == 0 ? Vec3{0.85F, 0.85F, 0.82F} : kColours[(region - 1) % kColours.size()];
}

World::World(Renderer& renderer, Visuals& visuals, const tessera::Client& client)
    : renderer_(renderer), visuals_(visuals), scene_(client.Scene()) {
  double extent = 0;
  for (std::size_t axis = 0; axis < 3; axis += 2) {
    extent = std::max(extent, scene_.bounds_max[axis] - scene_.bounds_min[axis]);
    target_[axis] = (scene_.bounds_min[axis] + scene_.bounds_max[axis]) / 2;
  }
  picture_.far_m = static_cast<float>(std::clamp(1.5 * extent, kNearestEnd_m, kFurthestEnd_m));
  renderer_.Clear();
  for (std::size_t i = 0; i < scene_.body_count; ++i) {
    Standing body{nullptr, TESSERA_BODY_INFO};
    if (tessera_scene_body(client.get(), i, &body.info) != TESSERA_OK) continue;
    if (body.info.dynamic != 0 || body.info.trigger != 0) continue;
    body.meshes = &MeshesOf(body.info.shape);
    standing_.push_back(body);
  }
}

const std::vector<World::Placed>& World::MeshesOf(const tessera_shape* shape, Shapes& shapes) {
  const auto [found, is_new] = shapes.try_emplace(shape);
  if (!is_new) return found->second;
  for (const Painted& painted : visuals_.MeshesOf(tessera::SceneShape(shape).Visuals())) {
    // A flag or a fence has no thickness.
    const Coat coat{.both_sides = true, .paint = painted.paint};
    found->second.push_back({renderer_.Add(painted.mesh, coat), {}, true});
  }
  if (!found->second.empty()) return found->second;
  for (const Part& part : PartsOf(shape)) {
    tessera::ShapeInfo info = TESSERA_SHAPE_INFO;
    if (tessera_get_shape(part.shape, &info) != TESSERA_OK) continue;
    const Mesh mesh = MeshOf(info, picture_.far_m);
    if (!mesh.empty()) found->second.push_back({renderer_.Add(mesh), part, false});
  }
  return found->second;
}

const std::vector<World::Placed>* World::MeshesOf(const tessera::Client& client, std::uint64_t body) {
  const auto [found, is_new] = bodies_.try_emplace(body, nullptr);
  if (!is_new) return found->second;
  const std::optional<tessera::BodyInfo> info = client.InfoOf(body);
  if (info && info->trigger == 0) found->second = &MeshesOf(info->shape);
  return found->second;
}

void World::Paint(const std::vector<Placed>& meshes, const double* position, const double* orientation, Copy as) {
  const float ground = as.is_ground;
  const std::array<double, 4> turn = {orientation[0], orientation[1], orientation[2], orientation[3]};
  for (const Placed& placed : meshes) {
    const std::array<double, 3> offset = Rotate(turn, placed.part.position);
    const std::array<double, 4> whole = Multiply(turn, placed.part.orientation);
    as.position = {static_cast<float>(position[0] + offset[0] - picture_.eye[0]),
                   static_cast<float>(position[1] + offset[1] - picture_.eye[1]),
                   static_cast<float>(position[2] + offset[2] - picture_.eye[2])};
    for (std::size_t i = 0; i < 4; ++i) as.orientation[i] = static_cast<float>(whole[i]);
    // A wall has its own colour; of a body's half says whose it is.
    as.own = !placed.coloured ? 0 : ground > 0 ? 1 : 1 - kOwnerShare;
    as.is_ground = placed.coloured ? 0 : ground;
    picture_.copies[placed.mesh].push_back(as);
  }
}

// The shapes of a tile that has gone are gone, too: nothing but its meshes is left.
void World::FollowTiles(const tessera::Client& client) {
  for (std::uint32_t number = 0; number < scene_.tile_count; ++number) {
    const bool here = client.Tile(number)->here != 0;
    const auto known = tiles_.find(number);
    if (here == (known != tiles_.end())) continue;
    if (!here) {
      for (const auto& [shape, meshes] : known->second.shapes) {
        for (const Placed& placed : meshes) {
          picture_.copies.erase(placed.mesh);
          renderer_.Remove(placed.mesh);
        }
      }
      tiles_.erase(known);
      continue;
    }
    Tile& tile = tiles_[number];
    for (const tessera::BodyInfo& info : client.TileBodies(number)) {
      tile.standing.push_back({&MeshesOf(info.shape, tile.shapes), info});
    }
  }
}

void World::PaintStatic() {
  Paint(standing_);
  for (const auto& [number, tile] : tiles_) Paint(tile.standing);
}

void World::Paint(const std::vector<Standing>& standing) {
  for (const Standing& body : standing) {
    tessera::ShapeInfo shape = TESSERA_SHAPE_INFO;
    tessera_get_shape(body.info.shape, &shape);
    Copy as;
    as.is_ground = 1;
    as.colour =
        shape.kind == TESSERA_SHAPE_PLANE || shape.kind == TESSERA_SHAPE_HEIGHT_FIELD ? kGroundColour : kWallColour;
    Paint(*body.meshes, body.info.position, body.info.orientation, as);
  }
}

void World::PlaceCamera(const tessera::Client& client, const std::vector<tessera::Body>& bodies, const Hands& hands,
                        float seconds) {
  const auto own = std::find_if(bodies.begin(), bodies.end(),
                                [](const tessera::Body& body) { return (body.flags & TESSERA_BODY_OWN) != 0; });
  const std::optional<std::array<double, 3>> spectating = client.SpectatorView();
  own_position_.reset();
  std::array<double, 3> goal = target_;
  double distance_m = hands.distance_m();
  if (spectating) {
    goal = *spectating;
    distance_m = 0;
  } else if (own != bodies.end()) {
    own_position_ = {own->position[0], own->position[1], own->position[2]};
    goal = {own->position[0], own->position[1] + kEyeAbove_m, own->position[2]};
  } else if (!placed_) {  // nobody has a body here: the whole from above
    distance_m = 0.3 * picture_.far_m;
  }
  const double share = placed_ ? 1 - std::exp(-seconds / kFollow_s) : 1;
  for (std::size_t i = 0; i < 3; ++i) target_[i] += share * (goal[i] - target_[i]);
  placed_ = placed_ || spectating || own != bodies.end();
  const double off_m = std::hypot(goal[0] - target_[0], goal[1] - target_[1], goal[2] - target_[2]);
  camera_arrived_ = own_position_ && off_m < kArrived_m;
  picture_.direction = LookDirection(hands.yaw(), hands.pitch());
  const std::array<float, 3> direction = {picture_.direction.x, picture_.direction.y, picture_.direction.z};
  for (std::size_t i = 0; i < 3; ++i) picture_.eye[i] = target_[i] - distance_m * direction[i];
  // A camera under the floor of the world shows nothing.
  picture_.eye[1] = std::max(picture_.eye[1], std::min(target_[1], 0.3));
  picture_.focus = picture_.direction * static_cast<float>(distance_m + 20);
}

const Picture& World::Look(tessera::Client& client, const Hands& hands, float seconds) {
  const std::vector<tessera::Body>& bodies = client.Bodies();
  PlaceCamera(client, bodies, hands, seconds);
  for (auto& [mesh, copies] : picture_.copies) copies.clear();
  FollowTiles(client);
  PaintStatic();
  for (const tessera::Body& body : bodies) {
    const auto from_eye = [&](std::size_t axis) {
      return static_cast<float>(body.position[axis] - picture_.eye[axis]);
    };
    if (Dot({from_eye(0), from_eye(1), from_eye(2)}, picture_.direction) < -kBehind_m) continue;
    const std::vector<Placed>* meshes = MeshesOf(client, body.id);
    if (meshes == nullptr) continue;
    Copy as;
    as.colour = ColourOf(body.region);
    if ((body.flags & TESSERA_BODY_ASLEEP) != 0) as.colour = Mix(as.colour, kAsleepColour, kAsleepShare);
    if ((body.flags & TESSERA_BODY_OWN) != 0) as.colour = kOwnColour, as.glow = 0.5F;
    Paint(*meshes, body.position, body.orientation, as);
  }
  return picture_;
}

}  // namespace desktop
