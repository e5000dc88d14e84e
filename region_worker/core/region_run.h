// RegionRun: a region and all that its worker does with it, from the moment it is built: steps it while it holds its
// lease, sends its log to the standby, keeps copies of its primaries, follows maps and failovers, makes and removes
// players' bodies, changes properties, takes messages of the game's backend.
//
//   RegionRun run(self, config, ...);
//   run.Begin(links, actions);
//   each order: run.Follow(order, now, links, actions);
//   each round: if (run.Advance(now, links, actions)) { run.Step(now, observer, links, actions); run.StepEnded(...); }
//
// It has 45 methods, of which some twenty let others read its parts.
//
// Every part owns its state and is passed the region; what goes out are actions. Links outlive it. Thread rule: one
// thread.
#pragma once

#include <memory>
#include <optional>
#include <string_view>
#include <vector>

#include "core/region/region.h"
#include "region_worker/core/actions.h"
#include "region_worker/core/backend_orders.h"
#include "region_worker/core/drop_log.h"
#include "region_worker/core/failover_follower.h"
#include "region_worker/core/game_log.h"
#include "region_worker/core/identity.h"
#include "region_worker/core/link_message.h"
#include "region_worker/core/link_table.h"
#include "region_worker/core/map_follower.h"
#include "region_worker/core/order.h"
#include "region_worker/core/player_places.h"
#include "region_worker/core/player_roster.h"
#include "region_worker/core/property_orders.h"
#include "region_worker/core/run_statistics.h"
#include "region_worker/core/silent_links.h"
#include "region_worker/core/standby_copies.h"
#include "region_worker/core/standby_log.h"
#include "region_worker/core/tick_driver.h"
#include "region_worker/core/world_clock.h"

namespace tessera::worker {

struct FailoverFigures {
  std::uint64_t failovers = 0;            // that this region went through
  std::uint64_t promotion_age_ticks = 0;  // how old the state was that the last one brought back
  std::uint64_t last_gap_ms = 0;          // time without a step that the last one cost
};

class RegionRun {
 public:
  // `views_have_a_radius`: clients see the surroundings of their body, so all regions must know where it is. They must
  // as well where there are teams, because its team is told along.
  RegionRun(const Identity& self, region::Config config, bool views_have_a_radius);

  // Sends the frames of the tick that the region begins with. Once, before anything else.
  void Begin(LinkTable& links, Actions& actions);
  // From now on ticks are due.
  void Run(TimePoint now, Actions& actions);

  // Repeating it does nothing. An error is a contradiction that this worker cannot live with.
  absl::Status Follow(const Order& order, TimePoint now, LinkTable& links, Actions& actions);
  // The regions that it needs links with: neighbours by the map in force, by the announced one and by a failover's,
  // the standby, the primaries. Ascending.
  std::vector<RegionId> Partners(const Order& order) const;
  // True once after each change of the map in force.
  bool MapCameIntoForce(Actions& actions) { return maps_.CameIntoForce(region(), actions); }

  void Receive(RegionId from, const LinkMessage& message, TimePoint now, LinkTable& links, Actions& actions);
  absl::Status TakeInput(const PlayerInput& input) { return ticks_.region().QueueInput(input); }
  absl::Status TakeCommand(PlayerNumber player, const region::PlayerCommand& command) {
    return ticks_.region().TakeCommand(player, command);
  }
  void AcknowledgeEvents(PlayerNumber player, std::uint32_t event) { ticks_.region().AcknowledgeEvents(player, event); }
  // As an order would name them, without one.
  void SetPlayers(std::span<const OrderedPlayer> players, bool joins, Actions& actions) {
    roster_.Set(players, joins, ticks_.region(), actions);
  }
  // The number of a request that the agent is to pass on now, if one is; the standby has been asked.
  std::optional<std::uint64_t> AskForLease(TimePoint now, const LinkTable& links, Actions& actions);
  void LeaseGranted(std::uint64_t number, Duration ttl) { standby_log_.LeaseGranted(number, ttl); }

  // Time passes. True: the next tick is to be stepped now.
  bool Advance(TimePoint now, LinkTable& links, Actions& actions);
  void Step(TimePoint now, const region::PhaseObserver& observer, LinkTable& links, Actions& actions);
  // `work`: the time that the tick took, without waiting.
  void StepEnded(TimePoint end, Duration work);
  // When the next tick is due; nullopt while only a message or an order can change anything.
  std::optional<TimePoint> wake_at(TimePoint now) const;

  const region::Region& region() const { return ticks_.region(); }
  const TickDriver& ticks() const { return ticks_; }
  const StandbyLog& standby_log() const { return standby_log_; }
  const StandbyCopies& copies() const { return copies_; }
  const FailoverFollower& failovers() const { return failovers_; }
  const PlayerPlaces* places() const { return places_ ? &*places_ : nullptr; }
  const PlayerRoster& roster() const { return roster_; }
  const RunStatistics& statistics() const { return statistics_; }
  const game::GameHost* game() const { return region().game(); }  // null without a game
  // As Region::PrepareGame.
  void PrepareGame(std::shared_ptr<game::GameHost> next) { ticks_.region().PrepareGame(std::move(next)); }
  const GameLog& game_log() const { return game_log_; }
  const FailoverFigures& failover_figures() const { return failover_figures_; }
  const DropCounts& drops() const { return drops_.counts(); }
  std::vector<PropertyAnswer> PropertyAnswers() const;
  std::vector<BackendAnswer> BackendAnswers() const { return backend_.Answers(region()); }
  MapVersion planned() const { return maps_.planned(region()); }
  MapVersion refused() const { return maps_.refused(); }
  bool paused() const { return paused_; }  // no lease: nothing is stepped, and nothing sent
  const WorldClock& clock() const { return clock_; }
  // Regions to which a link stands, without neighbours from which nothing comes over it. Ascending.
  std::vector<RegionId> HeardLinks(const LinkTable& links) const;
  // It steps, as far as it knows, unless the world is paused: it holds its lease, is in its map, and no failover is
  // under way.
  bool Moves(TimePoint now) const;

 private:
  bool MayStep(TimePoint now, Actions& actions);
  bool MayGiveUp() const;
  void WatchSilence(TimePoint now, const LinkTable& links);
  void FollowClock(TimePoint now, const LinkTable& links, Actions& actions);
  absl::Status FollowFailover(const Order& order, TimePoint now, LinkTable& links, Actions& actions);
  absl::Status Resume(const region::Resolution& resolution, TimePoint now, LinkTable& links, Actions& actions);
  void Publish(region::StepResult result, TimePoint now, const LinkTable& links, Actions& actions);
  void SendPlaces(const LinkTable& links, Actions& actions);

  std::uint32_t tick_rate_hz_;
  TickDriver ticks_;
  SilentLinks silent_links_;
  StandbyLog standby_log_;
  StandbyCopies copies_;
  MapFollower maps_;
  WorldClock clock_;
  FailoverFollower failovers_;
  PlayerRoster roster_;
  PropertyOrders properties_;
  BackendOrders backend_;
  std::optional<PlayerPlaces> places_;
  RunStatistics statistics_;
  GameLog game_log_;
  DropLog drops_;
  FailoverFigures failover_figures_;
  bool paused_ = false;
  bool resumed_ = false;   // after a failover, and has not stepped since
  bool joins_ = false;     // by its orders the map that it begins with is not in force yet
  bool left_out_ = false;  // the map in force has no place for it: it waits for its end
};

}  // namespace tessera::worker
