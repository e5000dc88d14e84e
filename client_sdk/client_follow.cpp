// Following the map: a client is connected to the regions that its interest touches.
#include "absl/strings/str_cat.h"
#include "client_sdk/client_impl.h"

namespace tessera::client {
namespace {

// Says why the time to join has passed in vain.
absl::Status NotJoined(const std::string& instance, const ConnectedRegions& regions, bool scene) {
  if (const RegionConnection* mute = regions.Mute()) {
    const std::string error = mute->last_error().empty() ? "" : absl::StrCat(": ", mute->last_error());
    return absl::DeadlineExceededError(absl::StrCat(mute->Where(), " does not answer", error));
  }
  const std::string what = scene ? "there are no regions" : "the regions do not send the scene";
  return absl::DeadlineExceededError(absl::StrCat("instance ", instance, ": ", what));
}

}  // namespace

ConnectedRegions::Interest Client::Impl::Interest() const {
  if (own.watches()) return {};
  return {.centre = own.Position(world, *session.scene), .owner = world.OwnerOf(own.id())};
}

void Client::Impl::Follow(TimePoint now) {
  if (!regions.FollowDue()) return;
  for (const RegionStats& gone : regions.DropGone(network)) {
    RegionChanged(now, gone.region, RegionEntry::Change::kGone);
    figures.Dropped(gone);
  }
  const ConnectedRegions::Interest interest = Interest();
  for (const RegionStats& dropped : regions.DropFar(interest, network)) {
    RegionChanged(now, dropped.region, RegionEntry::Change::kOutOfSight);
    figures.Dropped(dropped);
  }
  for (const RegionId lost : regions.MoveToEndpoints(now, network)) OnLost(now, lost);
  regions.AddNear(interest);
}

void Client::Impl::CheckProgress(TimePoint now) {
  const bool any = regions.AnyWelcomed(), scene = !delivery.under_way();
  const ClientProgress::Due due =
      progress.Look(now, {.scene = scene,
                          .all_welcomed = regions.AllWelcomed(),
                          .any_heard = regions.AnyHeard(network, ClientProgress::kHeardWithin)});
  if (due.late) {
    return End(NotJoined(settings.instance_id, regions, scene), "",
               settings.by_grant && !any && regions.Mute() != nullptr);
  }
  if (any && regions.searching()) regions.EndSearchIfFound(Interest());
  if (due.search) regions.Search();
  if (due.ask_grant) events.push_back({.kind = ClientEvent::Kind::kGrantNeeded});
  if (!due.lost) return;
  End(absl::UnavailableError(absl::StrCat("instance ", settings.instance_id, ": no region answers any more")), "",
      settings.by_grant);
}

// Another grant for the same player: it knows where the regions are now.
void Client::Impl::Renew(Session fresh) {
  session.credentials = std::move(fresh.credentials);
  if (regions.Renew(std::move(fresh.map), std::move(fresh.regions), network)) {
    events.push_back({.kind = ClientEvent::Kind::kMapChanged});
  }
  progress.EndSilence();
}

// The world goes on from a moment that was seen before: nothing that is known of it holds.
void Client::Impl::StartOver(TimePoint now) {
  events.push_back({.kind = ClientEvent::Kind::kRestored});
  world.Clear(events);
  properties.ForgetNews();
  for (const RegionId region : regions.Welcomed()) world.RegionBegins(now, region);
  pairs = PairBook();
  time.StartOver(now);
  inputs.Forget();
  prediction.Forget();
}

void Client::Impl::End(absl::Status why, std::string detail, bool needs_new_grant) {
  if (!progress.End(std::move(why), needs_new_grant)) return;
  prediction.DropThrown(world, events);
  if (detail.empty()) detail = std::string(progress.reason().message());
  for (RegionConnection& connection : regions.all()) connection.Stop(network);
  events.push_back({.kind = ClientEvent::Kind::kEnded, .detail = std::move(detail)});
}

}  // namespace tessera::client
