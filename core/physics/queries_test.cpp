// Queries of a world: what they see, in which order, and at what cost.
#include <gmock/gmock.h>

#include <algorithm>
#include <cmath>

#include "core/physics/testing/bodies.h"

namespace tessera::physics {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;

std::vector<BodyId> IdsOf(const QueryResult& result) {
  std::vector<BodyId> ids;
  for (const QueryHit& hit : result.hits) ids.push_back(hit.body);
  return ids;
}

BodyQuery RayOf(Vec3d from, Vec3d to, std::size_t most_hits = 1) {
  return {.from = from, .to = to, .filter = {}, .most_hits = most_hits};
}

BodyQuery OverlapOf(QueryShape shape, Vec3d at, Quatd orientation = {}) {
  return {.shape = shape, .orientation = orientation, .from = at, .to = at, .filter = {}, .most_hits = 64};
}

TEST(RayTest, HitsTheNearestWhereItIs) {
  World world({.origin = {1000, 0, 0}});
  AddAll(world, {Dynamic(2, Ball(), {1005, 0, 0}), Dynamic(3, Cube(), {1010, 0, 0}), Static(4, Ground(), {0, -5, 0})});
  const auto hits = world.FindBodies(RayOf({1000, 0.3, 0}, {1020, 0.3, 0})).hits;
  ASSERT_EQ(hits.size(), 1u);
  EXPECT_EQ(hits[0].body, BodyId(2));
  EXPECT_NEAR(hits[0].point.x, 1004.6, 1e-9);
  EXPECT_NEAR(hits[0].fraction, 4.6 / 20, 1e-9);
  EXPECT_NEAR(hits[0].normal.x, -0.8, 1e-9);
  EXPECT_NEAR(hits[0].normal.y, 0.6, 1e-9);
  const auto box = world.FindBodies(RayOf({1020, 0.3, 0}, {1000, 0.3, 0})).hits;
  ASSERT_EQ(box.size(), 1u);
  EXPECT_EQ(box[0].body, BodyId(3));
  EXPECT_NEAR(box[0].point.x, 1010.5, 1e-9);
  EXPECT_EQ(box[0].normal, (Vec3d{1, 0, 0}));
  const auto down = world.FindBodies(RayOf({990, 5, 30}, {990, -15, 30})).hits;
  ASSERT_EQ(down.size(), 1u);
  EXPECT_EQ(down[0].body, BodyId(4));
  EXPECT_NEAR(down[0].fraction, 0.5, 1e-12);
  EXPECT_THAT(IdsOf(world.FindBodies(RayOf({1000, 3, 0}, {1020, 3, 0}))), IsEmpty());
  EXPECT_THAT(IdsOf(world.FindBodies(RayOf({1000, 0.3, 0}, {1004, 0.3, 0}))), IsEmpty());
}

TEST(RayTest, SeesTurnedBodiesAndTheirParts) {
  World world({});
  BodyDef box = Static(1, Box(1, 0.1, 1), {0, 10, 0});
  box.initial.orientation = {0, 0, std::sin(0.25), std::cos(0.25)};  // .5 rad about z
  CompoundShape dumbbell;
  dumbbell.children = {{{{-2, 0, 0}, {}}, Ball(1)}, {{{2, 0, 0}, {}}, Ball(1)}};
  AddAll(world, {box, Static(2, MakeShapePtr(dumbbell), {0, -10, 0})});
  const auto tilted = world.FindBodies(RayOf({0, 20, 0}, {0, 5, 0})).hits;
  ASSERT_EQ(tilted.size(), 1u);
  EXPECT_NEAR(tilted[0].point.y, 10 + 0.1 / std::cos(0.5), 1e-6);
  EXPECT_NEAR(tilted[0].normal.x, -std::sin(0.5), 1e-6);
  EXPECT_NEAR(tilted[0].normal.y, std::cos(0.5), 1e-6);
  EXPECT_THAT(IdsOf(world.FindBodies(RayOf({0, -10, 5}, {0, -10, -5}))), IsEmpty()) << "between the two balls";
  const auto ball = world.FindBodies(RayOf({2, -10, 5}, {2, -10, -5})).hits;
  ASSERT_EQ(ball.size(), 1u);
  EXPECT_NEAR(ball[0].point.z, 1, 1e-6);
}

TEST(RayTest, CrossesALongHeightFieldAndALongMeshAtItsFirstTriangle) {
  constexpr int kSamples = 401;
  HeightFieldShape field{.columns = kSamples, .rows = kSamples, .spacing_m = 1, .heights_m = {}};
  TriangleMeshShape mesh;
  for (std::uint32_t z = 0; z < kSamples; ++z) {
    for (std::uint32_t x = 0; x < kSamples; ++x) {
      const float height = x >= 300 ? 10.0f : 0.0f;  // a cliff from x = 99 to 100
      field.heights_m.push_back(height);
      mesh.vertices.push_back({static_cast<float>(x) - 200, height, static_cast<float>(z) - 200});
      const std::uint32_t a = z * kSamples + x, below = a + kSamples;
      if (x + 1 == kSamples || z + 1 == kSamples) continue;
      mesh.triangles.push_back({a, below, a + 1});
      mesh.triangles.push_back({a + 1, below, below + 1});
    }
  }
  for (const ShapePtr& shape : {MakeShapePtr(field), MakeShapePtr(mesh)}) {
    World world({});
    AddAll(world, {Static(1, shape, {0, 50, 0})});
    const auto cliff = world.FindBodies(RayOf({-199, 55, -150}, {199, 55, 150}));
    ASSERT_EQ(cliff.hits.size(), 1u);
    EXPECT_NEAR(cliff.hits[0].point.x, 99.5, 1e-6);
    EXPECT_LT(cliff.work, 20'000u) << "far fewer triangles than there are";
    const auto down = world.FindBodies(RayOf({-40.3, 1000, 71.7}, {-40.3, 0, 71.7}));
    ASSERT_EQ(down.hits.size(), 1u);
    EXPECT_NEAR(down.hits[0].point.y, 50, 1e-9);
    EXPECT_EQ(down.hits[0].normal, (Vec3d{0, 1, 0}));
    const auto up = world.FindBodies(RayOf({-40.3, 0, 71.7}, {-40.3, 1000, 71.7}));
    ASSERT_EQ(up.hits.size(), 1u) << "from below";
    EXPECT_EQ(up.hits[0].normal, (Vec3d{0, -1, 0}));
    BodyQuery wide = RayOf({0, 80, 0}, {0, 0, 0});
    wide.shape = SphereShape{150};
    wide.most_work = 20'000;
    const QueryResult given_up = world.FindBodies(wide);
    EXPECT_FALSE(given_up.complete) << "100 000 triangles";
    EXPECT_EQ(given_up.work, wide.most_work);
    EXPECT_THAT(IdsOf(world.FindBodies(RayOf({-199, 61, -150}, {199, 61, 150}))), IsEmpty());
  }
}

TEST(RayTest, GivesHitsInTheirOrderAndNoMoreThanAskedFor) {
  World world({});
  for (std::uint64_t id = 1; id <= 9; ++id) {
    const BodyDef ball = Static(id, Ball(), {static_cast<double>((id * 4) % 9), 0, 0});
    world.Add(ball, ball.initial);
  }
  AddAll(world, {Static(20, Cube(), {4, 0, 0}), Static(10, Cube(), {4, 0, 0})});
  EXPECT_THAT(IdsOf(world.FindBodies(RayOf({-5, 0, 0}, {20, 0, 0}, 4))),
              ElementsAre(BodyId(9), BodyId(7), BodyId(5), BodyId(3)));
  EXPECT_THAT(IdsOf(world.FindBodies(RayOf({3.4, 0, 0}, {4.1, 0, 0}, 64))),
              ElementsAre(BodyId(3), BodyId(1), BodyId(10), BodyId(20)))
      << "equally far ones by id; inside of 3 from the start";
}

TEST(QueryTest, DoesNotDependOnTheOrderInWhichBodiesCame) {
  std::vector<BodyDef> bodies;
  for (std::uint64_t id = 1; id <= 200; ++id) {
    const auto x = static_cast<double>(id * 7 % 23), y = static_cast<double>(id * 5 % 11);
    bodies.push_back(id % 3 == 0 ? Static(id, Cube(0.4), {x, y, 0}) : Dynamic(id, Ball(0.4), {x, y, 0}));
  }
  World forward({}), backward({});
  AddAll(forward, bodies);
  std::reverse(bodies.begin(), bodies.end());
  AddAll(backward, bodies);
  // History as well: one of the two has had its bodies elsewhere.
  for (const BodyDef& body : bodies) {
    BodyState away = body.initial;
    away.position.z += 100;
    if (body.motion != Motion::kDynamic) continue;
    backward.SetState(body.id, away);
    backward.SetState(body.id, body.initial);
  }
  for (const std::size_t most : {1u, 5u, 300u}) {
    BodyQuery sweep = RayOf({-5, 3, 0}, {30, 6, 0}, most);
    for (const QueryShape& shape :
         {QueryShape(PointProbe{}), QueryShape(SphereShape{1}), QueryShape(BoxShape{{1, 2, 1}})}) {
      sweep.shape = shape;
      const QueryResult a = forward.FindBodies(sweep), b = backward.FindBodies(sweep);
      ASSERT_FALSE(a.hits.empty());
      EXPECT_EQ(a.work, b.work);
      ASSERT_EQ(IdsOf(a), IdsOf(b));
      for (std::size_t i = 0; i < a.hits.size(); ++i) {
        EXPECT_EQ(a.hits[i].fraction, b.hits[i].fraction);
        EXPECT_EQ(a.hits[i].point, b.hits[i].point);
      }
    }
  }
}

TEST(QueryTest, GivesUpAtItsBudgetAndSaysSo) {
  World world({});
  for (std::uint64_t id = 1; id <= 1000; ++id) {
    const BodyDef ball = Static(id, Ball(0.4), {static_cast<double>(id), 0, 0});
    world.Add(ball, ball.initial);
  }
  BodyQuery ray = RayOf({0, 0, 0}, {1001, 0, 0}, 1000);
  const QueryResult all = world.FindBodies(ray);
  EXPECT_TRUE(all.complete);
  EXPECT_EQ(all.hits.size(), 1000u);
  ray.most_work = all.work;
  EXPECT_TRUE(world.FindBodies(ray).complete);
  ray.most_work = all.work - 1;
  const QueryResult less = world.FindBodies(ray);
  EXPECT_FALSE(less.complete);
  EXPECT_THAT(IdsOf(less), IsEmpty());
  EXPECT_EQ(less.work, ray.most_work);
  BodyQuery nearest = RayOf({0, 0, 0}, {1001, 0, 0});
  EXPECT_LT(world.FindBodies(nearest).work, all.work) << "what lies behind the nearest is not looked at";
  nearest.most_work = 10;
  EXPECT_FALSE(world.FindBodies(nearest).complete);
}

TEST(QueryTest, FiltersByLayerByMotionByTriggerAndByBody) {
  World world({});
  BodyDef trigger = Static(1, Ball(), {1, 0, 0}), debris = Dynamic(2, Ball(), {3, 0, 0});
  trigger.trigger = true;
  debris.layer.index = 5;
  AddAll(world, {trigger, debris, Static(3, Ball(), {5, 0, 0}), Dynamic(4, Ball(), {7, 0, 0})});
  BodyQuery ray = RayOf({-2, 0, 0}, {20, 0, 0}, 10);
  EXPECT_THAT(IdsOf(world.FindBodies(ray)), ElementsAre(BodyId(2), BodyId(3), BodyId(4)));
  ray.filter.triggers = true;
  EXPECT_THAT(IdsOf(world.FindBodies(ray)), ElementsAre(BodyId(1), BodyId(2), BodyId(3), BodyId(4)));
  ray.filter.layers = 1u << 5;
  EXPECT_THAT(IdsOf(world.FindBodies(ray)), ElementsAre(BodyId(2)));
  ray.filter = {.static_bodies = false};
  EXPECT_THAT(IdsOf(world.FindBodies(ray)), ElementsAre(BodyId(2), BodyId(4)));
  ray.filter = {.dynamic_bodies = false};
  EXPECT_THAT(IdsOf(world.FindBodies(ray)), ElementsAre(BodyId(3)));
  ray.filter = {.ignored = {BodyId(4), BodyId(2), BodyId(99)}};
  EXPECT_THAT(IdsOf(world.FindBodies(ray)), ElementsAre(BodyId(3)));
}

TEST(QueryTest, SeesBodiesWhereTheLastStepLeftThem) {
  World world({.gravity_m_s2 = {}});
  BodyDef fast = Dynamic(2, Ball(), {});
  fast.initial.linear_velocity = {600, 0, 0};
  world.Add(fast, fast.initial);
  for (int i = 1; i <= 5; ++i) {
    world.Step(kDt);
    const double x = world.StateOf(fast.id).position.x;
    EXPECT_NEAR(x, 10 * i, 1e-3);
    EXPECT_THAT(IdsOf(world.FindBodies(RayOf({x, 5, 0}, {x, -5, 0}))), ElementsAre(fast.id));
    EXPECT_THAT(IdsOf(world.FindBodies(RayOf({x - 10, 5, 0}, {x - 10, -5, 0}))), IsEmpty());
    EXPECT_THAT(world.Overlapping(Aabb{{x - 0.1, -1, -1}, {x + 0.1, 1, 1}}), ElementsAre(fast.id));
  }
}

// A ball that a wall throws back lies outside of all that the broad phase thought it could reach.
TEST(QueryTest, SeesABodyThatWasDeflectedAndForgetsOneThatWasRemoved) {
  World world({.gravity_m_s2 = {}});
  BodyDef heavy = Dynamic(1, Ball(), {-8, 0.4, 0}, 1000), light = Dynamic(2, Ball(), {0, 0, 0}, 0.01);
  heavy.initial.linear_velocity = {100, 0, 0};
  AddAll(world, {heavy, light});
  for (int i = 0; i < 30; ++i) {
    world.Step(kDt);
    const Vec3d at = world.StateOf(light.id).position;
    BodyQuery ray = RayOf(at + Vec3d{0, 0, 5}, at - Vec3d{0, 0, 5}, 2);
    ray.filter.ignored = {heavy.id};
    ASSERT_THAT(IdsOf(world.FindBodies(ray)), ElementsAre(light.id)) << i;
    EXPECT_THAT(world.Overlapping({at - Vec3d{0.1, 0.1, 0.1}, at + Vec3d{0.1, 0.1, 0.1}}), testing::Contains(light.id));
  }
  EXPECT_GT(Length(world.StateOf(light.id).linear_velocity), 50) << "it was hit";
  const Vec3d at = world.StateOf(light.id).position;
  world.Remove(light.id);
  EXPECT_THAT(IdsOf(world.FindBodies(OverlapOf(SphereShape{1}, at))), testing::Not(testing::Contains(light.id)));
}

// Whatever is asked of whatever is there: what comes back is a place on the way.
TEST(QueryTest, AbsurdSizesAndPlacesGiveSoundAnswers) {
  for (const double away : {0.0, 1e4, 9e6}) {
    World world({});
    const std::vector<ShapePtr> shapes = {
        Ball(1e-3),
        Ball(1e4),
        Box(1e-3, 1e4, 1e-3),
        Box(1e4, 1e-3, 1e4),
        MakeShapePtr(CapsuleShape{1e-3, 1e4}),
        MakeShapePtr(CylinderShape{1e4, 1e-3}),
        MakeShapePtr(ConeShape{1e-3, 1e4}),
        MakeShapePtr(ConeShape{1e4, 1e-3}),
        MakeShapePtr(TriangleMeshShape{{{-1e4f, 0, 0}, {1e4f, 0, 0}, {0, 0, 1e-3f}}, {{{0, 1, 2}}, {{0, 0, 0}}}})};
    for (std::size_t i = 0; i < shapes.size(); ++i) {
      const BodyDef body = Static(i + 1, shapes[i], {away, 0.1 * static_cast<double>(i), -away});
      world.Add(body, body.initial);
    }
    std::uint32_t seed = 1;
    const auto draw = [&seed] {
      return static_cast<double>((seed = seed * 1664525u + 1013904223u) >> 8) / (1 << 23) - 1;
    };
    for (int i = 0; i < 300; ++i) {
      const double reach = i % 3 == 0 ? 1e-2 : i % 3 == 1 ? 10 : 5e3;
      const Vec3d from{away + reach * draw(), reach * draw(), -away + reach * draw()};
      BodyQuery query = RayOf(from, from + Vec3d{reach * draw(), reach * draw(), reach * draw()}, 20);
      query.orientation = Normalized(Quatd{draw(), draw(), draw(), draw()});
      for (const QueryShape& shape :
           {QueryShape(PointProbe{}), QueryShape(SphereShape{1e-3}), QueryShape(SphereShape{1e3}),
            QueryShape(CapsuleShape{1e-3, 1e3}), QueryShape(BoxShape{{1e-3, 1e3, 1e-3}})}) {
        query.shape = shape;
        const QueryResult result = world.FindBodies(query);
        ASSERT_TRUE(result.complete);
        double last = 0;
        for (const QueryHit& hit : result.hits) {
          ASSERT_GE(hit.fraction, last);
          ASSERT_LE(hit.fraction, 1);
          ASSERT_TRUE(IsFinite(hit.point));
          ASSERT_NEAR(Length(hit.normal), 1, 1e-6);
          last = hit.fraction;
        }
      }
    }
  }
}

TEST(OverlapTest, OfAShapeIsExact) {
  World world({});
  AddAll(world, {Static(9, Ground(), {0, -10, 0}), Dynamic(7, Ball(), {3, 3, 0}), Dynamic(2, Cube(), {-3, 0, 0})});
  // Bounds overlap at (1.9, 1.9); the balls themselves, 1.56 m apart and 1.5 m long, do not.
  EXPECT_THAT(IdsOf(world.FindBodies(OverlapOf(SphereShape{1}, {1.9, 1.9, 0}))), IsEmpty());
  EXPECT_THAT(IdsOf(world.FindBodies(OverlapOf(SphereShape{1}, {2.0, 2.0, 0}))), ElementsAre(BodyId(7)));
  const BoxShape rod{{6, 0.1, 0.1}};
  EXPECT_THAT(IdsOf(world.FindBodies(OverlapOf(rod, {}))), ElementsAre(BodyId(2)));
  const double s = std::sin(0.39269908), c = std::cos(0.39269908);  // 45 degrees about z: through (3, 3)
  EXPECT_THAT(IdsOf(world.FindBodies(OverlapOf(rod, {}, {0, 0, s, c}))), ElementsAre(BodyId(7)));
  EXPECT_THAT(IdsOf(world.FindBodies(OverlapOf(SphereShape{1}, {50, -10.5, 3}))), ElementsAre(BodyId(9)));
  EXPECT_THAT(IdsOf(world.FindBodies(OverlapOf(SphereShape{8}, {}))), ElementsAre(BodyId(2), BodyId(7)));
  BodyQuery one = OverlapOf(SphereShape{8}, {});
  one.most_hits = 1;
  EXPECT_THAT(IdsOf(world.FindBodies(one)), ElementsAre(BodyId(2)));
  EXPECT_THAT(IdsOf(world.FindBodies(OverlapOf(PointProbe{}, {3, 3.4, 0}))), ElementsAre(BodyId(7)));
}

TEST(OverlapTest, OfABoxGoesByBounds) {
  World world({});
  AddAll(world, {Dynamic(7, Ball(), {3, 3, 0}), Dynamic(2, Cube(), {-3, 0, 0})});
  EXPECT_THAT(world.Overlapping(Aabb{{2, 2, -1}, {2.51, 2.51, 1}}), ElementsAre(BodyId(7)));
  EXPECT_THAT(world.Overlapping(Aabb{{2, 2, -1}, {2.49, 2.49, 1}}), IsEmpty());
  EXPECT_THAT(world.Overlapping(Aabb{{-9, -9, -9}, {9, 9, 9}}), ElementsAre(BodyId(2), BodyId(7)));
}

TEST(QueryTest, LeavesTheWorldAsItWas) {
  const auto run = [](bool ask) {
    World world({});
    AddAll(world, {Static(1, Ground()), Dynamic(2, Cube(), {0, 0.8, 0}), Dynamic(3, Cube(), {0.2, 2, 0.1})});
    for (int i = 0; i < 120; ++i) {
      world.Step(kDt);
      if (!ask) continue;
      world.FindBodies(OverlapOf(SphereShape{2}, {0, 1, 0}));
      world.FindBodies(RayOf({0, 5, 0}, {0, -5, 0}));
    }
    return world.StateOf(BodyId(3));
  };
  EXPECT_EQ(run(false), run(true));
}

}  // namespace
}  // namespace tessera::physics
