// Settings of a region: each with its unit, its reason, and what breaks if it changes.
#pragma once

#include <cstddef>
#include <cstdint>

namespace tessera::region {

struct RegionSettings {
  // A body is relevant to a neighbour when its swept bounds, grown by this, reach one of the neighbour's cells, or come
  // near a body of the neighbour's, wherever that is. Less than the margin of contacts, and a body comes upon another
  // unseen; more, and ghosts cost what bodies cost.
  double aura_m = 0.1;
  // How far ahead the swept bounds look, ticks. At least 2: a frame is used one tick after it was made.
  std::uint32_t lookahead_ticks = 4;
  // For how many ticks a region promises that nothing of it but sleepers is near a border. More, and a border that
  // nobody is near costs less and waits for nobody; but what starts without warning near it is seen so much later. 0:
  // never.
  std::uint32_t promise_ticks = 8;
  // In a pile that moves, bodies that lie up to so many contacts behind those in reach of the aura are relevant as
  // well; in a pile at rest none, because its ghosts bear the loads of those behind them. With 0 a body that is struck
  // across a border gives way as if it lay on nothing: boxes of a pile of 1240 that falls together come to lie 15 mm
  // within each other, in one world 7, and end a fifth further from where one world has them than its own runs do; with
  // 1 neither. Each layer costs what its bodies cost, twice.
  std::uint32_t ghost_depth = 1;
  // An island is relevant as a whole if one of its bodies is relevant and a region has no more than so many of them:
  // all that see it then solve the same, to the bit. More, and larger piles cost what they cost once per region. With 2
  // and more, an island whose bodies are all near the border is whole whatever its size.
  std::uint32_t whole_up_to = 32;
  // A body is handed over only when it is this far beyond its owner's cells, so that one standing on a border stays.
  double hysteresis_m = 0.25;
  // Bodies that one region hands over in one tick, at most; an assembly goes whole. What a new map moves goes in
  // batches, because a body costs its new owner about as much as a step of several. Less, and a change takes longer.
  std::uint32_t max_grants_per_tick = 64;
  // All regions compute in the same local coordinates. Equal to the bit, at the price of float error far from the
  // world's centre.
  bool shared_origin = false;
  // Threads that work on a step of the physics, the region's own among them; their number changes no bit. More than the
  // processors that it has to itself, and its steps wait for others.
  std::uint32_t threads = 1;
};

// The most that an instance may ask for of `ghost_depth` and `whole_up_to`.
inline constexpr std::uint32_t kMaxGhostDepth = 64, kMaxWholeUpTo = 100'000;
// The most threads that a region may have: physics::kMaxStepThreads.
inline constexpr std::uint32_t kMaxRegionThreads = 32;

// A body whose fastest point was slower than this, m/s, for so many ticks is settled: settled ghosts do not touch each
// other. Fewer ticks, or more speed, and bodies that still move act through loads, which come late; less speed, and a
// pile that trembles costs the contacts among its ghosts.
inline constexpr std::uint8_t kSettledTicks = 12;
inline constexpr float kSettled_m_s = 0.05f;
// Physics origins lie on this grid, m: regions that are near each other mostly share one, and differences of two
// origins are exact in float.
inline constexpr double kOriginGrid_m = 64;
// The longest promise of a neighbour: frames with a longer one are refused.
inline constexpr std::uint32_t kMaxPromised = 64;
// The same where a game may push any body in any tick.
inline constexpr std::uint32_t kMaxPromisedWithGame = 2;
// For so many ticks beyond those that a game may look back, regions remember where bodies were: as long as a question
// from another region takes. Less, and regions that are far from each other give incomplete answers.
inline constexpr std::size_t kQuestionDelayTicks = 24;
// A link that is down asks to reconnect every so many ticks: few requests wait for a neighbour that stands still.
inline constexpr std::uint32_t kReconnectIntervalTicks = 6;
// A link comes up this many ticks after the later side has heard of it: longer than a message takes to come and go.
// Less, and a reconnection fails and is tried again; more, and it takes longer.
inline constexpr std::uint64_t kReconnectDelayTicks = 12;
// While a link is down, who is further behind than this, ticks, adopts the other's tick before they agree on one to
// reconnect at; who is less far behind gets there by its own steps. More than kReconnectDelayTicks, which each side may
// be away.
inline constexpr std::uint64_t kFarBehind = 24;
// So many requests to reconnect that come after this side is up take its link down again: the neighbour that it waits
// for may wait for it. A neighbour that only has a few ticks to go sends fewer.
inline constexpr std::uint32_t kMaxReconnects = 8;
// While a link is up, a frame whose tick differs from this side's adds so much to its desynchronisation score, one with
// the same tick takes one off, and beyond the limit the link is taken down, to come up between the right steps. Where
// links around a corner came up between steps that do not belong together, ticks run ahead of steps for ever, and each
// link of the circle sees it in one of as many frames as the circle has links: circles of up to some thirty are found.
// The effect of a reconnection elsewhere passes in a frame or two.
inline constexpr std::uint32_t kDesyncPenalty = 32;
inline constexpr std::uint32_t kMaxDesyncScore = 24 * kDesyncPenalty;
// No neighbour is further ahead: a month at 240 ticks a second.
inline constexpr std::uint64_t kMaxTicksAhead = 600'000'000;
// Inputs of one player that wait for their tick. A client that runs ahead is refused rather than delayed ever further.
inline constexpr std::size_t kMaxQueuedInputs = 8;
// A new owner may get a full queue with the grant and as many that reached the old owner just after it.
inline constexpr std::size_t kMaxGrantedInputs = 2 * kMaxQueuedInputs;

// Ticks for which a character goes on by its last input where none is there. More, and a player whose connection is
// gone runs on; fewer, and a late input is felt as a stumble.
inline constexpr std::uint8_t kMaxHeldTicks = 15;

}  // namespace tessera::region
