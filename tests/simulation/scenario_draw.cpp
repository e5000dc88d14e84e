#include <algorithm>
#include <cmath>

#include "absl/strings/str_cat.h"
#include "tests/simulation/scenario.h"
#include "tests/simulation/scene_builder.h"

namespace tessera::simulation {
namespace {

constexpr double kHalf = 12;  // half the ground's side, m
constexpr std::uint64_t kTicks = 240;
constexpr Micros kLength = kTicks * 1'000'000 / 60;
constexpr std::size_t kFaultsOfShells = 9;  // the first ones; deaths are drawn apart
constexpr std::size_t kWorldsDrawn = 9;     // the first ones; the others are there when asked for

Vec3f AnyVelocity(Chance& chance, double most) {
  return {static_cast<float>(chance.Between(-most, most)), static_cast<float>(chance.Between(-most, most) / 4),
          static_cast<float>(chance.Between(-most, most))};
}

ShapePtr AnyShape(Chance& chance, double size) {
  switch (chance.Below(5)) {
    case 0:
      return Box(size * 0.8);
    case 1:
      return MakeShape(CapsuleShape{size * 0.7, size * 0.6});
    case 2:
      return MakeShape(CylinderShape{size * 0.8, size * 0.7});
    case 3:
      return MakeShape(ConeShape{size, size * 1.6});
    default:
      return Ball(size);
  }
}

// Around everything, as far up and down as `half_height_m`.
void Walls(SceneBuilder& builder, double half_height_m = 20) {
  for (const double side : {-1.0, 1.0}) {
    for (const bool along : {false, true}) {
      BodyDef& wall =
          builder.Add(MakeShape(BoxShape{along ? Vec3d{1, half_height_m, kHalf} : Vec3d{kHalf, half_height_m, 1}}),
                      along ? Vec3d{side * kHalf, 0, 0} : Vec3d{0, 0, side * kHalf});
      wall.motion = Motion::kStatic;
      wall.mass_kg = 0;
      wall.material.restitution = 1;
      wall.material.friction = 0;
    }
  }
}

// Bodies that fly free and meet now and then.
void Swarm(SceneBuilder& builder, Chance& chance, bool closed) {
  if (!closed) Walls(builder);
  const std::uint64_t side = 3 + chance.Below(4);
  const double gap = 18.0 / static_cast<double>(side);
  const bool balls = chance.Happens(0.5);
  for (std::uint64_t i = 0; i < side * side; ++i) {
    const Vec3d place{-8.5 + static_cast<double>(i % side) * gap, chance.Between(-0.5, 0.5),
                      -8.5 + static_cast<double>(i / side) * gap};
    BodyDef& body =
        builder.Add(balls ? Ball(0.4) : AnyShape(chance, 0.4), place, AnyVelocity(chance, 8), chance.Between(0.5, 4));
    body.material.restitution = chance.Unit();
    body.material.friction = chance.Happens(0.5) ? 0 : 0.5;
    body.may_sleep = false;
  }
}

// Balls that fall in on a point where regions meet, and change hands while they touch.
void Cloud(SceneBuilder& builder, Chance& chance) {
  const Vec3d middle{chance.Between(-1, 1), 0, chance.Between(-1, 1)};
  const double swirl = chance.Between(0, 0.8);
  for (int i = 0; i < 27; ++i) {
    const Vec3d place{-1.4 + i % 3 * 1.4, -1.4 + i / 3 % 3 * 1.4, -1.4 + i / 9 * 1.4};
    const Vec3d inward = place * -1.2 + Vec3d{place.z, 0, -place.x} * swirl;
    BodyDef& ball = builder.Add(Ball(0.5), middle + place, Vec3f(inward), chance.Between(1, 8));
    ball.material.restitution = chance.Unit();
    ball.may_sleep = false;
  }
}

// Assemblies that fly over borders and corners.
void Chains(SceneBuilder& builder, Chance& chance, bool closed) {
  if (!closed) Walls(builder);
  std::uint64_t next = builder.scene().bodies.size() + 1;
  for (int i = 0; i < 9; ++i) {
    const Vec3f velocity = AnyVelocity(chance, 6);
    const std::uint64_t links = 2 + chance.Below(3);
    for (std::uint64_t j = 0; j < links; ++j, ++next) {
      const Vec3d place{-8.0 + i % 3 * 6.5 + static_cast<double>(j) * 1.0, 0, -7.0 + i / 3 * 6.5};
      builder.Add(Box(0.3), place, velocity, chance.Between(1, 2)).may_sleep = false;
      if (j > 0) builder.Tie(BodyId(next - 1), BodyId(next), {0.5, 0, 0}, {-0.5, 0, 0});
    }
  }
}

// Where cells meet: an edge, or a corner if there is one.
Vec3d OnABorder(const PartitionMap& map, Chance& chance) {
  const Cell& cell = map.cells()[chance.Below(map.cells().size())];
  const double x = cell.area.min_x > map.bounds().min_x ? cell.area.min_x : cell.area.max_x;
  const double z = cell.area.min_z > map.bounds().min_z ? cell.area.min_z : cell.area.max_z;
  const Vec3d middle{(cell.area.min_x + cell.area.max_x) / 2, 0, (cell.area.min_z + cell.area.max_z) / 2};
  switch (chance.Below(3)) {
    case 0:
      return {x, 0, middle.z};
    case 1:
      return {middle.x, 0, z};
    default:
      return {x, 0, z};
  }
}

bool Inside(Vec3d place) { return std::abs(place.x) < kHalf - 2 && std::abs(place.z) < kHalf - 2; }

void Stacks(SceneBuilder& builder, Chance& chance, const PartitionMap& map) {
  builder.Gravity().Floor(0.6);
  for (int i = 0; i < 4; ++i) {
    const Vec3d foot = OnABorder(map, chance);
    if (!Inside(foot)) continue;
    const Vec3d aside{static_cast<double>(i % 2) * 3.1, 0, static_cast<double>(i / 2) * 3.1};
    for (int j = 0; j < 5; ++j) {
      builder.Add(Box(0.5), foot + aside + Vec3d{chance.Between(-0.05, 0.05), 0.5 + j, chance.Between(-0.05, 0.05)});
    }
  }
  for (int i = 0; i < 3; ++i) {  // these knock some of them over
    builder.Add(Ball(0.5), {-8, 1.5 + i, -6.0 + 5 * i}, {static_cast<float>(chance.Between(4, 12)), 0, 0}, 3);
  }
}

void Crowd(SceneBuilder& builder, Chance& chance, const PartitionMap& map) {
  builder.Gravity().Floor(0.5);
  const Cell& cell = map.cells()[chance.Below(map.cells().size())];
  const double x = cell.area.min_x > map.bounds().min_x ? cell.area.min_x : cell.area.max_x;
  for (int i = 0; i < 20; ++i) {
    const double at = std::clamp(x, -kHalf + 2, kHalf - 2);
    builder.Add(i % 2 == 0 ? Ball(0.4) : Box(0.4), {at, 0.4 + 0.02 * (i % 3), -9.5 + i});
  }
}

void Giant(SceneBuilder& builder, Chance& chance) {
  builder.Gravity().Floor(0.5);
  builder.Add(MakeShape(BoxShape{{7, 0.5, 7}}), {chance.Between(-3, 3), 0.5, chance.Between(-3, 3)},
              {static_cast<float>(chance.Between(-2, 2)), 0, 0}, 800);
  for (int i = 0; i < 12; ++i) {
    builder.Add(AnyShape(chance, 0.5), {-6.0 + i % 4 * 4, 2.0 + i / 4, -6.0 + i / 4 * 5}, AnyVelocity(chance, 2),
                chance.Between(0.5, 3));
  }
}

void Vortex(SceneBuilder& builder, Chance& chance) {
  builder.Gravity().Floor(0.3);
  Walls(builder);
  std::uint64_t next = builder.scene().bodies.size() + 1;
  for (int i = 0; i < 36; ++i, ++next) {
    builder.Add(AnyShape(chance, 0.4), {-9.0 + i % 6 * 3.5, 0.8, -9.0 + i / 6 * 3.5}, {}, chance.Between(0.5, 4));
    if (i % 6 == 5) builder.Tie(BodyId(next - 1), BodyId(next), {1.75, 0, 0}, {-1.75, 0, 0});
  }
  builder.scene().fields.push_back(VortexField{{0, 0, 0}, 30, chance.Between(0.5, 1.2), 4});
}

void Players(SceneBuilder& builder, Chance& chance) {
  builder.Gravity().Floor(0.3);
  Walls(builder);
  PlayerRules rules;
  rules.body.shape = Ball(0.5);
  rules.body.mass_kg = 2;
  for (int i = 0; i < 6; ++i) rules.spawn_points.push_back({-8.0 + i * 3, 0.6, chance.Between(-8, 8)});
  rules.max_force_n = 80;
  rules.max_speed_m_s = 12;
  builder.scene().player = rules;
  for (int i = 0; i < 10; ++i) {
    builder.Add(AnyShape(chance, 0.5), {-8.0 + i % 5 * 4, 0.8, -6.0 + i / 5 * 12}, {}, chance.Between(0.5, 2));
  }
}

// Fast balls and pairs that hardly ever touch: as many handovers as can be had.
void Mill(SceneBuilder& builder, Chance& chance) {
  Walls(builder);
  std::uint64_t next = builder.scene().bodies.size() + 1;
  for (int i = 0; i < 56; ++i) {
    const Vec3f velocity{static_cast<float>(chance.Between(-14, 14)), 0, static_cast<float>(chance.Between(-14, 14))};
    const Vec3d place{-9.5 + i % 8 * 2.5, -14.0 + 0.5 * i, -9.5 + i / 8 * 2.7};
    for (int j = 0; j < (i % 7 == 0 ? 2 : 1); ++j, ++next) {
      BodyDef& ball = builder.Add(Ball(0.15), place + Vec3d{0.4 * j, 0, 0}, velocity);
      ball.material.restitution = 1;
      ball.material.friction = 0;
      ball.may_sleep = false;
      if (j > 0) builder.Tie(BodyId(next - 1), BodyId(next), {0.2, 0, 0}, {-0.2, 0, 0});
    }
  }
}

// As many handovers as can be had: small balls, pairs and threes that stream over a ground of small cells, each at a
// height of its own so that none meets another. Some pairs tumble about corners.
void Stream(SceneBuilder& builder, Chance& chance) {
  constexpr int kSide = 15;
  constexpr double kLevel_m = 0.4;
  Walls(builder, 60);
  std::uint64_t next = builder.scene().bodies.size() + 1;
  for (int i = 0; i < kSide * kSide; ++i) {
    const int links = i % 8 == 0 ? 3 : i % 4 == 0 ? 2 : 1;
    Vec3d place{-9.5 + i % kSide * 1.3, -0.5 * kLevel_m * kSide * kSide + kLevel_m * i, -9.5 + i / kSide * 1.3};
    Vec3f velocity{static_cast<float>(chance.Between(-36, 36)), 0, static_cast<float>(chance.Between(-36, 36))};
    const bool corner = i % 16 == 4;
    if (corner) {
      place = {-6.0 + 6 * static_cast<double>(chance.Below(3)), place.y,
               -6.0 + 6 * static_cast<double>(chance.Below(3))};
      velocity = {};
    }
    for (int j = 0; j < links; ++j, ++next) {
      const Vec3f spin{0, 0, corner ? (j == 0 ? 7.0F : -7.0F) : 0};
      BodyDef& ball = builder.Add(Ball(0.12), place + Vec3d{(corner ? 1.2 : 0.3) * j, 0, 0}, velocity + spin);
      ball.material.restitution = 1;
      ball.material.friction = 0;
      ball.may_sleep = false;
      const double arm = corner ? 0.6 : 0.15;
      if (j > 0) builder.Tie(BodyId(next - 1), BodyId(next), {arm, 0, 0}, {-arm, 0, 0});
    }
  }
}

// Deaths, and mostly a new worker afterwards.
void Deaths(std::vector<ScheduledFault>& faults, Chance& chance, std::uint64_t regions, Micros length,
            std::uint64_t fewest) {
  const std::uint64_t count = fewest + chance.Below(3 * fewest);
  for (std::uint64_t i = 0; i < count; ++i) {
    ScheduledFault kill;
    kill.kind = FaultKind::kKill;
    kill.from = Milliseconds(300) + chance.Below(length);
    kill.until = kill.from + Milliseconds(1500);
    kill.a = RegionId(static_cast<std::uint32_t>(1 + chance.Below(regions)));
    faults.push_back(kill);
    if (chance.Happens(0.2)) continue;
    kill.kind = FaultKind::kRestart;
    kill.from += Milliseconds(20) + chance.Below(200'000);
    kill.until = kill.from + Milliseconds(2000);
    faults.push_back(kill);
  }
}

// Cut in two again and again, somewhere in the middle of the longer side.
PartitionMap AnyMap(Rect bounds, Chance& chance) {
  constexpr std::array<std::uint32_t, 8> kCounts = {1, 2, 2, 3, 4, 4, 6, 9};
  const std::uint32_t regions = kCounts[chance.Below(kCounts.size())];
  if (chance.Happens(0.6)) return *MakeGridMap(bounds, regions);
  std::vector<Rect> areas = {bounds};
  while (areas.size() < regions) {
    const auto largest = std::max_element(areas.begin(), areas.end(), [](const Rect& a, const Rect& b) {
      return (a.max_x - a.min_x) * (a.max_z - a.min_z) < (b.max_x - b.min_x) * (b.max_z - b.min_z);
    });
    Rect first = *largest, second = *largest;
    const double at = chance.Between(0.35, 0.65);
    if (first.max_x - first.min_x > first.max_z - first.min_z) {
      first.max_x = second.min_x = first.min_x + at * (first.max_x - first.min_x);
    } else {
      first.max_z = second.min_z = first.min_z + at * (first.max_z - first.min_z);
    }
    *largest = first;
    areas.push_back(second);
  }
  std::vector<Cell> cells;
  std::vector<MapRegion> ids;
  for (std::uint32_t i = 0; i < areas.size(); ++i) {
    cells.push_back({areas[i], RegionId(i + 1), Epoch(1)});
    ids.push_back({RegionId(i + 1), regions == 1 ? RegionId() : RegionId((i + 1) % regions + 1)});
  }
  return *PartitionMap::Create(MapVersion(1), bounds, cells, ids);
}

ScheduledFault FaultOf(FaultKind kind, Chance& chance, std::uint64_t regions, Micros length) {
  ScheduledFault fault;
  fault.kind = kind;
  fault.from = chance.Below(length);
  fault.until = fault.from + Milliseconds(50) + chance.Below(length / 2);
  fault.a = RegionId(static_cast<std::uint32_t>(1 + chance.Below(regions)));
  fault.b = RegionId(static_cast<std::uint32_t>(1 + chance.Below(regions)));
  switch (fault.kind) {
    case FaultKind::kLoss:
    case FaultKind::kReorder:
    case FaultKind::kDuplicate:
      fault.strength = chance.Between(0.02, 0.4);
      break;
    case FaultKind::kDelay:
      fault.strength = chance.Between(1'000, 40'000);
      break;
    case FaultKind::kJitter:
      fault.strength = chance.Between(1'000, 30'000);
      break;
    case FaultKind::kSlow:
      fault.strength = chance.Between(20'000, 60'000);
      break;
    case FaultKind::kPartition:
    case FaultKind::kStall:  // as often shorter than what closes a border as longer
      fault.until = fault.from + Milliseconds(30) + chance.Below(chance.Happens(0.5) ? 200'000 : 2'500'000);
      break;
    default:
      break;
  }
  return fault;
}

// Bad network conditions, cuts and standstills for about half of the time, mostly too short to close a border.
void StreamFaults(std::vector<ScheduledFault>& faults, Chance& chance, std::uint64_t regions) {
  for (std::size_t kind = 0; kind < kFaultsOfShells; ++kind) {
    // Little gets through loss: it lasts, and comes more often.
    const bool loss = static_cast<FaultKind>(kind) == FaultKind::kLoss;
    if (!chance.Happens(loss ? 0.7 : 0.4)) continue;
    const bool once = static_cast<FaultKind>(kind) >= FaultKind::kBreak;
    for (std::uint64_t i = once ? 3 + chance.Below(4) : 1; i > 0; --i) {
      ScheduledFault fault = FaultOf(static_cast<FaultKind>(kind), chance, regions, kLength);
      const bool brief = once && chance.Happens(0.9);
      fault.until = fault.from + (brief ? Milliseconds(40) + chance.Below(190'000) : Milliseconds(1800));
      if (!loss) {
        faults.push_back(fault);
        continue;
      }
      fault.from /= 4;
      fault.until = fault.from + Milliseconds(3000);
      fault.strength /= 4;
      faults.push_back(fault);
    }
  }
}

}  // namespace

Scenario DrawScenario(std::uint64_t seed, const DrawOptions& options) {
  Chance chance(seed);
  Scenario scenario;
  scenario.seed = seed;
  const auto any = static_cast<WorldKind>(chance.Below(kWorldsDrawn));
  scenario.world = options.world.value_or(any);
  SceneBuilder builder(kHalf);
  scenario.map = AnyMap(builder.scene().ground(), chance);
  scenario.ticks = kTicks;
  scenario.settings.shared_origin = chance.Happens(0.5);
  if (chance.Happens(0.2)) scenario.settings.hysteresis_m = 0;
  const bool closed = chance.Happens(0.5);
  switch (scenario.world) {
    case WorldKind::kSwarm:
      Swarm(builder, chance, closed);
      scenario.closed = closed;
      break;
    case WorldKind::kCloud:
      Cloud(builder, chance);
      scenario.closed = true;
      break;
    case WorldKind::kChains:
      Chains(builder, chance, closed);
      scenario.closed = closed;
      break;
    case WorldKind::kStacks:
      Stacks(builder, chance, scenario.map);
      break;
    case WorldKind::kCrowd:
      Crowd(builder, chance, scenario.map);
      break;
    case WorldKind::kGiant:
      Giant(builder, chance);
      break;
    case WorldKind::kVortex:
      Vortex(builder, chance);
      break;
    case WorldKind::kPlayers:
      Players(builder, chance);
      scenario.players = static_cast<std::uint32_t>(1 + chance.Below(6));
      break;
    case WorldKind::kMill:
      scenario.map = *MakeGridMap(builder.scene().ground(), chance.Happens(0.5) ? 9 : 16);
      Mill(builder, chance);
      break;
    case WorldKind::kStream:
      scenario.map = *MakeGridMap(builder.scene().ground(), chance.Happens(0.5) ? 9 : 16);
      Stream(builder, chance);
      break;
  }
  scenario.scene = builder.Build();
  if (options.faults && scenario.world == WorldKind::kStream) {
    StreamFaults(scenario.faults, chance, scenario.map.regions().size());
  } else if (options.faults && chance.Happens(0.85)) {
    const std::uint64_t count = 1 + chance.Below(6);
    for (std::uint64_t i = 0; i < count; ++i) {
      const auto kind = static_cast<FaultKind>(chance.Below(kFaultsOfShells));
      scenario.faults.push_back(FaultOf(kind, chance, scenario.map.regions().size(), kLength));
    }
  }
  const std::uint64_t regions = scenario.map.regions().size();
  const bool dense = scenario.world == WorldKind::kStream;
  if (options.faults && regions > 2 && scenario.players == 0 && chance.Happens(dense ? 0.9 : 0.25)) {
    Deaths(scenario.faults, chance, regions, kLength, dense ? 4 : 1);
  }
  return scenario;
}

std::string Describe(const Scenario& scenario) {
  std::string text =
      absl::StrCat(kWorldNames[static_cast<std::size_t>(scenario.world)], " of ", scenario.scene->bodies.size(), " on ",
                   scenario.map.regions().size(), " regions, ", scenario.ticks, " ticks");
  for (const ScheduledFault& fault : scenario.faults) {
    absl::StrAppend(&text, ", ", kFaultNames[static_cast<std::size_t>(fault.kind)], " ", fault.from / 1000, "-",
                    fault.until / 1000, " ms");
  }
  return text;
}

}  // namespace tessera::simulation
