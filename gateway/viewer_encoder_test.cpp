// Frames as differences, and the golden messages that the page's decoder reads too.
#include "gateway/viewer_encoder.h"

#include <gmock/gmock.h>

#include <cmath>
#include <numbers>
#include <set>

#include "core/world/byte_view.h"
#include "core/world/scene_load.h"
#include "core/world/sha256.h"
#include "gateway/testing/golden.h"
#include "gateway/testing/viewer_decoder.h"
#include "gateway/viewer_format.h"

namespace tessera::gateway {
namespace {

using testing::ElementsAre;

constexpr char kAllShapes[] = R"(
  name: "shapes"
  bounds { min { x: -50 y: -5 z: -50 } max { x: 50 y: 50 z: 50 } }
  properties { name: "health" number: 100 }
  properties { name: "home" vector { x: 1 y: 2 z: 3 } }
  bodies { id: 1 name: "ground" motion: MOTION_STATIC shape { plane { normal { y: 1 } } } }
  bodies { id: 2 name: "door" motion: MOTION_STATIC trigger: true shape { box { half_extents { x: 1 y: 2 z: 3 } } }
           pose { position { x: 4 y: 5 z: 6 } } }
  bodies { id: 3 motion: MOTION_STATIC shape { mesh { vertices { x: 0 } vertices { x: 1 } vertices { z: 1 }
           indices: [0, 2, 1] } } }
  bodies { id: 4 motion: MOTION_STATIC shape { height_field { columns: 2 rows: 3 spacing: 2
           heights: [0, 1, 2, 3, 4, 5] } } }
  bodies { id: 10 name: "ball" mass: 1 shape { sphere { radius: 0.5 } } }
  bodies { id: 11 mass: 1 shape { capsule { radius: 0.5 half_height: 1 } } }
  bodies { id: 12 mass: 1 shape { cylinder { radius: 0.5 half_height: 1 } } }
  bodies { id: 13 mass: 1 shape { cone { radius: 0.5 height: 2 } } }
  bodies { id: 14 mass: 1 shape { hull { points { x: 0 } points { x: 1 } points { y: 1 } points { z: 1 } } } }
  bodies { id: 15 mass: 1 shape { compound {
           children { shape { sphere { radius: 0.25 } } pose { position { x: -1 } } }
           children { shape { box { half_extents { x: 0.5 y: 0.5 z: 0.5 } } } pose { position { x: 1 } } } } } }
)";

std::shared_ptr<const Scene> SceneOf(const std::string& text) {
  const auto loaded = LoadScene(SceneForm::kText, text, "scene.textproto");
  EXPECT_TRUE(loaded.ok()) << loaded.status();
  return loaded.ok() ? loaded->scene : nullptr;
}

// A picture whose bodies have one identity each.
class PictureBuilder {
 public:
  PictureBuilder& At(std::uint64_t tick) {
    picture_.tick = Tick(tick);
    picture_.time_s = static_cast<double>(tick) / 60;
    return *this;
  }
  PictureBuilder& Put(std::uint64_t id, Vec3d position, std::uint32_t owner = 1, std::uint8_t state = 0) {
    auto& identity = identities_[id];
    if (identity == nullptr) Rename(id, id > 1000 ? "ada" : "ball");
    PictureBody body;
    body.id = BodyId(id);
    body.identity = identity.get();
    body.number = numbers_[id];
    body.position = PackPosition(position);
    body.orientation = PackOrientation(Quatd());
    body.owner = owner;
    body.state = state;
    body.speed = PackSpeed({3, 4, 0});
    bodies_[id] = body;
    return *this;
  }
  PictureBuilder& Remove(std::uint64_t id) {
    bodies_.erase(id);
    return *this;
  }
  void Rename(std::uint64_t id, const std::string& name) {
    auto identity = std::make_unique<Identity>();
    identity->shape = 1;
    identity->player = PlayerOf(BodyId(id));
    identity->name = name;
    identity->mass_kg = 2;
    numbers_[id] = ++last_;
    if (bodies_.contains(id)) {
      bodies_[id].identity = identity.get();
      bodies_[id].number = last_;
    }
    identities_[id] = std::move(identity);
  }
  const Picture& Make() {
    picture_.bodies.clear();
    for (const auto& [id, body] : bodies_) picture_.bodies.push_back(body);
    return picture_;
  }

 private:
  Picture picture_;
  std::map<std::uint64_t, PictureBody> bodies_;
  std::map<std::uint64_t, std::unique_ptr<Identity>> identities_;
  std::map<std::uint64_t, std::uint32_t> numbers_;
  std::uint32_t last_ = 0;
};

class ViewerEncoderTest : public testing::Test {
 protected:
  ViewerEncoderTest() { decoder_.shapes = 1; }
  nlohmann::ordered_json Frame(const ViewerView& view = {}) {
    ByteWriter out;
    content_ = encoder_.Frame(builder_.Make(), view, out);
    bytes_ = out.size();
    return decoder_.Take(out.bytes());
  }
  std::vector<std::uint64_t> Ids() const {
    std::vector<std::uint64_t> ids;
    for (const auto& [id, body] : decoder_.bodies) ids.push_back(id);
    return ids;
  }

  PictureBuilder builder_;
  ViewerEncoder encoder_;
  ViewerDecoder decoder_;
  FrameContent content_;
  std::size_t bytes_ = 0;
};

TEST(PackTest, OrientationIsWithinAThousandthOfTheTurn) {
  for (const Quatd& q : {Quatd(), Quatd{0.5, -0.5, 0.5, -0.5}, Quatd{1, 0, 0, 0}, Quatd{0, 0.6, 0, -0.8}}) {
    const std::uint32_t packed = PackOrientation(q);
    const std::uint32_t left_out = packed >> 30;
    std::array<double, 4> parts{};
    double rest = 1;
    int shift = 20;
    for (std::uint32_t i = 0; i < 4; ++i) {
      if (i == left_out) continue;
      parts[i] = ((packed >> shift & 1023) / 1023.0 - 0.5) * std::numbers::sqrt2;
      rest -= parts[i] * parts[i];
      shift -= 10;
    }
    parts[left_out] = std::sqrt(std::max(0.0, rest));
    const double dot = parts[0] * q.x + parts[1] * q.y + parts[2] * q.z + parts[3] * q.w;
    EXPECT_NEAR(std::abs(dot), 1, 1e-5);
  }
}

TEST_F(ViewerEncoderTest, AFrameHoldsWhatDiffersFromTheOneBefore) {
  builder_.At(10).Put(5, {1, 2, 3}).Put(9, {-4, 0, 0.5}, 2);
  Frame();
  EXPECT_EQ(content_.appeared, 2u);
  EXPECT_EQ(content_.changed, 2u);
  EXPECT_EQ(decoder_.bodies.at(9).Metres(), (Vec3d{-4, 0, 0.5}));
  EXPECT_EQ(decoder_.bodies.at(9).owner, 2u);
  EXPECT_EQ(decoder_.bodies.at(5).speed, 5u * 64);

  builder_.At(11);
  Frame();
  EXPECT_TRUE(content_.empty());
  EXPECT_LT(bytes_, 16u);

  builder_.At(12).Put(9, {-4.25, 0, 0.5}, 2, kAsleepState).Remove(5);
  const auto words = Frame();
  EXPECT_EQ(content_.vanished, 1u);
  EXPECT_EQ(content_.changed, 1u);
  EXPECT_FALSE(words["changed"][0].contains("owner")) << "it has not changed";
  EXPECT_THAT(Ids(), ElementsAre(9));
  EXPECT_EQ(decoder_.bodies.at(9).Metres(), (Vec3d{-4.25, 0, 0.5}));
  EXPECT_EQ(decoder_.bodies.at(9).state, kAsleepState);
}

TEST_F(ViewerEncoderTest, WhoMissedManyPicturesIsSentTheNewestAlone) {
  builder_.Put(5, {0, 0, 0});
  Frame();
  for (int i = 1; i <= 100; ++i) builder_.At(10 + i).Put(5, {i * 0.5, 0, 0}).Put(1000, {0, i * 1.0, 0});
  builder_.Remove(1000);
  Frame();
  EXPECT_THAT(Ids(), ElementsAre(5)) << "what came and went meanwhile is not told of";
  EXPECT_EQ(decoder_.bodies.at(5).Metres().x, 50);
}

TEST_F(ViewerEncoderTest, AViewWithARadiusShowsWhatIsInItWithoutFlickering) {
  builder_.Put(1, {0, 0, 0}).Put(2, {10.5, 99, 0}).Put(3, {30, 0, 0});
  Frame({.center = {}, .radius_m = 10});
  EXPECT_THAT(Ids(), ElementsAre(1)) << "height does not count";
  builder_.Put(2, {9.5, 99, 0});
  Frame({.center = {}, .radius_m = 10});
  EXPECT_THAT(Ids(), ElementsAre(1, 2));
  builder_.Put(2, {10.5, 99, 0});
  Frame({.center = {}, .radius_m = 10});
  EXPECT_THAT(Ids(), ElementsAre(1, 2)) << "it stays up to a tenth further";
  Frame({.center = {30, 0, 0}, .radius_m = 10});
  EXPECT_THAT(Ids(), ElementsAre(3));
  Frame();
  EXPECT_THAT(Ids(), ElementsAre(1, 2, 3)) << "without a radius: everything";
}

TEST_F(ViewerEncoderTest, WhoseNameComesLaterIsSentAnew) {
  const std::uint64_t player = PlayerBodyId(PlayerNumber(3)).value();
  builder_.Put(player, {1, 1, 1});
  builder_.Rename(player, "");
  Frame();
  EXPECT_EQ(decoder_.bodies.at(player).player, 3u);
  builder_.Rename(player, "ada");
  Frame();
  EXPECT_EQ(decoder_.bodies.at(player).name, "ada");
  EXPECT_EQ(decoder_.bodies.at(player).Metres(), (Vec3d{1, 1, 1}));
}

TEST_F(ViewerEncoderTest, FarPlacesAndTheHighestIdAreExact) {
  constexpr std::uint64_t kHighest = ~std::uint64_t{0};
  builder_.Put(1, {-1e7, 1e7, 1e7}).Put(kHighest, {1e7, 0, 0});
  Frame();
  EXPECT_EQ(decoder_.bodies.at(1).Metres().x, -1e7);
  EXPECT_TRUE(decoder_.bodies.contains(kHighest));
}

// --- A limit of bytes ------------------------------------------------------------------------------------------------

TEST_F(ViewerEncoderTest, WithALimitNearAndFastBodiesAreSentFirst) {
  // Ten slow ones far away, ten slow ones near, ten fast ones far away.
  const auto put = [this](double t) {
    for (std::uint64_t i = 0; i < 10; ++i) {
      const double z = static_cast<double>(i);
      builder_.Put(1 + i, {300 + t * 0.1, 0, z}).Put(11 + i, {t * 0.1, 0, z}).Put(21 + i, {-300 + t * 30, 0, z});
    }
  };
  put(0);
  Frame();
  put(1);
  const auto words = Frame({.near_first = true, .max_bytes = 140});
  EXPECT_LE(bytes_, 150u);
  EXPECT_EQ(words["flags"], kDeferredFlag);
  EXPECT_EQ(content_.changed + content_.deferred, 30u);
  const auto sent = [this](std::uint64_t first, double x) {
    int count = 0;
    for (std::uint64_t id = first; id < first + 10; ++id)
      count += std::abs(decoder_.bodies.at(id).Metres().x - x) < 1e-3;
    return count;
  };
  EXPECT_EQ(sent(21, -270), 10) << "fast";
  EXPECT_GE(sent(11, 0.1), 3) << "near";
  EXPECT_EQ(sent(1, 300.1), 0);
}

TEST_F(ViewerEncoderTest, WithALimitEachBodyHasItsTurnAndStillWorldIsCompleteInTheEnd) {
  constexpr std::uint64_t kBodies = 200;
  std::set<std::uint64_t> unseen;
  const auto put = [this](int t) {
    for (std::uint64_t id = 1; id <= kBodies; ++id) {
      builder_.Put(id, {static_cast<double>(id) + t * 0.01 * static_cast<double>(id), 0, 0});
    }
  };
  for (std::uint64_t id = 1; id <= kBodies; ++id) unseen.insert(id);
  for (int t = 0; t < 400; ++t) {
    put(t);
    const auto words = Frame({.near_first = true, .max_bytes = 150});
    EXPECT_LT(bytes_, 150u + 60);
    for (const auto& [id, body] : decoder_.bodies) {
      if (t >= 200 && std::abs(body.Metres().x - static_cast<double>(id) * (1 + t * 0.01)) < 1e-3) unseen.erase(id);
    }
  }
  EXPECT_THAT(unseen, testing::IsEmpty()) << "of these nothing new was sent in 200 frames";
  do {
    Frame({.near_first = true, .max_bytes = 150});
    ASSERT_GT(content_.changed + (content_.deferred == 0), 0u) << "no frame is without progress";
  } while (content_.deferred > 0);
  for (const auto& [id, body] : decoder_.bodies) EXPECT_NEAR(body.Metres().x, static_cast<double>(id) * 4.99, 1e-3);
}

TEST_F(ViewerEncoderTest, TheSelectedBodyIsSentBeforeAll) {
  for (std::uint64_t id = 1; id <= 50; ++id) builder_.Put(id, {0, 0, 0});
  builder_.Put(60, {1000, 0, 0});
  Frame({.near_first = true, .foremost = BodyId(60), .max_bytes = 45});
  EXPECT_THAT(Ids(), ElementsAre(60));
}

TEST_F(ViewerEncoderTest, ABodyThatWaitsForRoomMayGoUnsentOrBeRenamed) {
  builder_.Put(1, {0, 0, 0}).Put(2, {100, 0, 0}).Put(3, {100, 0, 0});
  Frame({.near_first = true, .max_bytes = 45});
  EXPECT_THAT(Ids(), ElementsAre(1));
  EXPECT_EQ(content_.deferred, 2u);
  builder_.Remove(2);
  Frame();
  EXPECT_EQ(content_.vanished, 0u) << "nobody has seen it";
  EXPECT_THAT(Ids(), ElementsAre(1, 3));

  builder_.Put(1, {50, 0, 0}).Rename(3, "crate");
  builder_.Put(3, {100, 0, 0});
  Frame({.near_first = true, .max_bytes = 45});
  EXPECT_THAT(Ids(), ElementsAre(1, 3)) << "it stays under its old name";
  EXPECT_EQ(decoder_.bodies.at(3).name, "ball");
  Frame();
  EXPECT_EQ(decoder_.bodies.at(3).name, "crate");
  EXPECT_EQ(decoder_.bodies.at(3).Metres().x, 100);
}

// --- Golden messages. The page's tests read the same files. --------------------------------------------------------

TEST(GoldenMessageTest, VisualsAreAsEverBetweenShapesAndStatics) {
  const auto scene = SceneOf(R"(
    name: "drawn"
    bounds { min { x: -50 y: -5 z: -50 } max { x: 50 y: 50 z: 50 } }
    bodies { id: 1 motion: MOTION_STATIC shape { plane { normal { y: 1 } } } }
    bodies { id: 2 mass: 1 shape { sphere { radius: 0.5 }
             visuals { sha256: "0123456789abcdef0123456789abcdef0123456789abcdef0123456789abcdef" mesh: 300
                       pose { position { x: 1 y: -2 z: 0.5 } orientation { y: 1 } } scale { x: -0.5 y: 2 z: 1 } }
             visuals { sha256: "fedcba9876543210fedcba9876543210fedcba9876543210fedcba9876543210" } } }
    bodies { id: 3 mass: 1 shape { sphere { radius: 0.5 } } })");
  ASSERT_NE(scene, nullptr);
  const SceneBook book(*scene);
  ASSERT_EQ(book.messages().size(), 3u);
  ViewerDecoder decoder;
  decoder.Take(book.messages()[0]);
  EXPECT_EQ(decoder.shapes, 3u) << "two balls that look otherwise";
  ExpectGolden("8-visuals", book.messages()[1], decoder);
  decoder.Take(book.messages()[2]);
  EXPECT_EQ(decoder.statics, 1u);
}

// A square kilometre under a ball, with a thousand boxes that look alike.
Scene LargeLevel() {
  Scene scene;
  scene.name = "large";
  scene.bounds = {{-600, -10, -600}, {600, 50, 600}};
  HeightFieldShape field{.columns = 1000, .rows = 1000, .spacing_m = 1, .heights_m = {}};
  for (int i = 0; i < 1'000'000; ++i) field.heights_m.push_back(static_cast<float>(i % 5));
  const auto box = std::make_shared<const Shape>(Shape{BoxShape{{1, 1, 1}}});
  for (std::uint64_t i = 0; i <= 1001; ++i) {
    BodyDef& def = scene.bodies.emplace_back();
    def.id = BodyId(i + 1);
    def.shape = box;
    def.motion = Motion::kStatic;
    def.mass_kg = 0;
    def.initial.position = {static_cast<double>(i % 30) * 30 - 450, 6, static_cast<double>(i / 30) * 30 - 450};
  }
  scene.bodies[0].shape = std::make_shared<const Shape>(Shape{std::move(field)});
  scene.bodies[0].initial.position = {};
  scene.bodies[1001].shape = std::make_shared<const Shape>(Shape{SphereShape{1}});
  scene.bodies[1001].motion = Motion::kDynamic;
  scene.bodies[1001].mass_kg = 1;
  return scene;
}

TEST(SceneBookTest, ALargeLevelIsAListOfTilesAndEachIsThereByItsHash) {
  const Scene scene = LargeLevel();
  const SceneBook book(scene);
  ViewerDecoder decoder;
  for (const Bytes& message : book.messages()) decoder.Take(message);
  EXPECT_EQ(decoder.statics, 0u);
  EXPECT_EQ(decoder.shapes, 2u) << "the ball, and the box that tiles share";
  EXPECT_EQ(book.NumberOf(*scene.bodies[1001].shape), 1u);
  ASSERT_GT(decoder.tiles.size(), 8u);
  const auto tiles = decoder.tiles;
  for (const auto& [sha256, bytes] : tiles) {
    const auto content = book.TileBy(sha256);
    ASSERT_NE(content, nullptr);
    EXPECT_EQ(content->size(), bytes);
    EXPECT_EQ(Sha256Hex(*content), sha256);
    ByteReader in(AsBytes(*content));
    while (in.ok() && in.remaining() > 0) decoder.Take(in.Block(content->size()));
    EXPECT_TRUE(in.ok()) << in.error();
  }
  EXPECT_GE(decoder.statics, 1000u + tiles.size() / 2) << "boxes, and a part of the field in each tile";
  EXPECT_EQ(decoder.statics, 1000u + decoder.shapes - 2);
  EXPECT_EQ(book.TileBy(std::string(64, 'a')), nullptr);
  EXPECT_EQ(book.TileBy("../secret"), nullptr);
}

TEST(SceneBookTest, APartOfAHeightFieldHasARimOfItsNeighboursSamples) {
  const Scene scene = LargeLevel();
  const SceneBook book(scene);
  ViewerDecoder decoder;
  for (const Bytes& message : book.messages()) decoder.Take(message);
  const auto& whole = std::get<HeightFieldShape>(scene.bodies[0].shape->form).heights_m;
  int parts = 0, corners = 0, inner = 0;
  for (const auto& [sha256, bytes] : decoder.tiles) {
    ByteReader in(AsBytes(*book.TileBy(sha256)));
    while (in.ok() && in.remaining() > 0) {
      const nlohmann::ordered_json words = decoder.Take(in.Block(bytes));
      if (!words.contains("shapes")) continue;
      for (const nlohmann::ordered_json& shape : words["shapes"]) {
        if (!shape.contains("heights")) continue;
        ++parts;
        const int rim = shape["rim"];
        corners += rim == 5 || rim == 6 || rim == 9 || rim == 10;
        inner += rim == 15;
        const int wide = static_cast<int>(shape["columns"]) + (rim & 1) + (rim >> 1 & 1);
        // Heights of the whole repeat after five samples, and a row is 1000 of them: those of a row tell its place.
        const std::vector<float> heights = shape["heights"];
        for (std::size_t i = 1; i < heights.size(); ++i) {
          if (i % static_cast<std::size_t>(wide) == 0) {
            ASSERT_EQ(heights[i], heights[0]) << "rows are of one place";
          } else {
            ASSERT_EQ(heights[i], whole[static_cast<std::size_t>(heights[i - 1]) + 1]);
          }
        }
      }
    }
  }
  EXPECT_GT(parts, 8);
  EXPECT_EQ(corners, 4);
  EXPECT_EQ(inner, parts - 4 * (static_cast<int>(std::lround(std::sqrt(parts))) - 1));
}

TEST(GoldenMessageTest, AreAsEverInTheOrderOfAConnection) {
  const auto scene = SceneOf(kAllShapes);
  ASSERT_NE(scene, nullptr);
  ViewerDecoder decoder;
  const Welcome welcome{.instance = "inst-7", .own_body = PlayerBodyId(PlayerNumber(2)), .own_player = PlayerNumber(2)};
  ExpectGolden("1-welcome", EncodeWelcome(welcome, *scene), decoder);
  const SceneBook book(*scene);
  ASSERT_EQ(book.messages().size(), 2u);
  ExpectGolden("2-shapes", book.messages()[0], decoder);
  EXPECT_EQ(decoder.shapes, 12u);
  ExpectGolden("3-statics", book.messages()[1], decoder);
  EXPECT_EQ(decoder.statics, 4u);
  const PartitionMap map = *MakeGridMap(scene->ground(), 4);
  ExpectGolden("4-map", EncodeMap(map, {{RegionId(1), "alpha"}, {RegionId(2), "beta"}, {RegionId(3), "alpha"}}),
               decoder);

  PictureBuilder builder;
  ViewerEncoder encoder;
  const auto frame = [&](const std::string& name) {
    ByteWriter out;
    encoder.Frame(builder.Make(), {}, out);
    ExpectGolden(name, out.bytes(), decoder);
  };
  builder.At(600).Put(10, {1, 2, 3}).Put(300, {-20.5, 0, 40}, 4);
  builder.Put(PlayerBodyId(PlayerNumber(2)).value(), {0, 1, 0}, 2, kPredictedState);
  frame("5-frame-first");
  builder.At(602).Put(10, {1.125, 2, 2.5}, 3).Put(300, {-20.5, 0, 40}, 4, kAsleepState);
  frame("6-frame-changes");
  builder.At(604).Remove(10).Put(11, {5, 5, 5});
  frame("7-frame-vanished");
}

}  // namespace
}  // namespace tessera::gateway
