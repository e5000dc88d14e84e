#include "core/world/movement.h"

#include <gtest/gtest.h>

#include <string>

namespace tessera {
namespace {

int StandStill(const tessera_movement_tick*, void*, tessera_movement_push*) { return 0; }

tessera_movement Hover() {
  return {sizeof(tessera_movement), TESSERA_MOVEMENT_ABI, "hover", 3, 12, "car", StandStill, nullptr};
}

Scene WithCars() {
  Scene scene;
  scene.kinds = {"", "car"};
  scene.player.emplace();
  return scene;
}

TEST(MovementTest, IsTakenWithAllThatItSays) {
  const tessera_movement table = Hover();
  const auto movement = MovementIn(WithCars(), table);
  ASSERT_TRUE(movement.ok()) << movement.status();
  EXPECT_EQ(movement->name, "hover");
  EXPECT_EQ(movement->version, 3U);
  EXPECT_EQ(movement->state_bytes, 12U);
  BodyDef def;
  EXPECT_FALSE(movement->Moves(def));
  def.kind = 1;
  EXPECT_TRUE(movement->Moves(def));
  tessera_movement all = Hover();
  all.kind = nullptr;
  EXPECT_TRUE(MovementIn(WithCars(), all)->Moves(BodyDef()));
}

TEST(MovementTest, EachFaultIsNamed) {
  const auto why = [](auto change) {
    tessera_movement table = Hover();
    change(table);
    return std::string(MovementIn(WithCars(), table).status().message());
  };
  EXPECT_EQ(why([](tessera_movement& table) { table.abi = 8; }),
            "movement: is made for version 8 of the interface, and this is version 1");
  EXPECT_EQ(why([](tessera_movement& table) { table.size = 8; }),
            "movement: has a table of 8 bytes, of " + std::to_string(sizeof(tessera_movement)));
  const std::string names = "movement: name: must be 1 to 31 letters, digits, '_' and '-'";
  EXPECT_EQ(why([](tessera_movement& table) { table.name = nullptr; }), names);
  EXPECT_EQ(why([](tessera_movement& table) { table.name = ""; }), names);
  EXPECT_EQ(why([](tessera_movement& table) { table.name = "a car"; }), names);
  EXPECT_EQ(why([](tessera_movement& table) { table.name = "nnnnnnnnnnnnnnnnnnnnnnnnnnnnnnnn"; }), names);
  EXPECT_EQ(why([](tessera_movement& table) { table.state_bytes = 65; }),
            "movement hover: state_bytes: 65 are more than 64");
  EXPECT_EQ(why([](tessera_movement& table) { table.move = nullptr; }), "movement hover: move: is missing");
  EXPECT_EQ(why([](tessera_movement& table) { table.kind = "cart"; }),
            "movement hover: kind: the scene has no kind \"cart\"");
  const tessera_movement table = Hover();
  Scene nobody = WithCars();
  nobody.player.reset();
  EXPECT_EQ(MovementIn(nobody, table).status().message(), "movement hover: the scene has no player");
}

TEST(MovementStateTest, ComesBackAsItWas) {
  MovementState state{.body = BodyId(77), .version = 3, .size = 12};
  for (std::uint8_t i = 0; i < 12; ++i) state.bytes[i] = i;
  ByteWriter out;
  Write(out, state);
  Write(out, MovementState());
  const std::vector<std::uint8_t> bytes = out.Take();
  ByteReader in(bytes);
  EXPECT_EQ(ReadMovementState(in), state);
  EXPECT_EQ(ReadMovementState(in), MovementState());
  EXPECT_TRUE(in.ok() && in.remaining() == 0);
}

TEST(MovementStateTest, MoreBytesThanThereMayBeAreRefused) {
  ByteWriter out;
  out.Varint(77);
  out.Varint(3);
  out.Block(std::vector<std::uint8_t>(TESSERA_MAX_MOVEMENT_STATE + 1));
  const std::vector<std::uint8_t> bytes = out.Take();
  ByteReader in(bytes);
  ReadMovementState(in);
  EXPECT_EQ(in.error(), "too long");
}

TEST(MovementStateTest, AnothersCountsAsNothing) {
  const tessera_movement table = Hover();
  const GameMovement movement = *MovementIn(WithCars(), table);
  MovementState state = StateFor(movement, BodyId(7), {});
  state.bytes[0] = 9;
  EXPECT_EQ(StateFor(movement, BodyId(7), state), state);
  EXPECT_EQ(StateFor(movement, BodyId(8), state).bytes[0], 0);
  GameMovement newer = movement;
  newer.version = 4;
  EXPECT_EQ(StateFor(newer, BodyId(7), state).bytes[0], 0);
  newer = movement;
  newer.state_bytes = 4;
  EXPECT_EQ(StateFor(newer, BodyId(7), state).bytes[0], 0);
}

}  // namespace
}  // namespace tessera
