#include "region_worker/player_news.h"

#include <algorithm>
#include <span>
#include <utility>

#include "core/game/joint.h"
#include "core/game/player_record.h"

namespace tessera::worker {
namespace {

void PutLimits(const PlayerLimits& limits, v1::PlayerNews& news) {
  if (limits.empty()) return;
  v1::PlayerLimits& out = *news.mutable_limits();
  if (limits.force_n) out.set_force_n(*limits.force_n);
  if (limits.torque_nm) out.set_torque_nm(*limits.torque_nm);
  if (limits.speed_m_s) out.set_speed_m_s(*limits.speed_m_s);
  out.set_axis_x(limits.axes.x);
  out.set_axis_y(limits.axes.y);
  out.set_axis_z(limits.axes.z);
}

}  // namespace

std::optional<v1::RegionControl> NewsFor(const region::Region& region, PlayerNumber player,
                                         std::optional<SentNews>& sent) {
  const game::PlayerRecord* const talk = region.TalkOf(player);
  if (talk == nullptr) {
    sent.reset();
    return std::nullopt;
  }
  const bool first = !sent.has_value();
  if (first) sent.emplace();
  v1::RegionControl message;
  if (talk->ended()) {
    if (std::exchange(sent->ended, true)) return std::nullopt;
    message.mutable_session_ended()->set_reason(talk->reason);
    return message;
  }
  const std::span<const region::OwnedBody> owned = region.owned();
  const auto body = std::ranges::lower_bound(owned, PlayerBodyId(player), {},
                                             [](const region::OwnedBody& one) { return one.def->id; });
  std::optional<Vec3d> view;
  const BodyId controlled = talk->driven();
  const bool aside = talk->hidden() && controlled == BodyId();  // also on the way to another body
  if (aside) view = body->state.position;
  std::vector<std::uint8_t> joints = game::EncodeJoints(region.JointsOf(player));
  if (!first && sent->last_command == talk->last_command && sent->last_event == talk->last_event &&
      sent->view == view && sent->controlled == controlled && sent->limits == talk->limits && sent->joints == joints) {
    return std::nullopt;
  }
  v1::PlayerNews& news = *message.mutable_player_news();
  news.set_epoch(body->epoch.value());
  news.set_last_command(talk->last_command);
  news.set_last_event(talk->last_event);
  std::uint32_t number = talk->first_event();
  for (const game::PlayerEvent& event : talk->events) {
    if (number++ <= sent->last_event) continue;
    v1::GameEvent& out = *news.add_events();
    out.set_name(event.name);
    out.set_values(event.values.data(), event.values.size());
  }
  news.set_spectating(view.has_value());
  if (view) {
    news.set_view_x(view->x);
    news.set_view_y(view->y);
    news.set_view_z(view->z);
  }
  news.set_controlled_body(controlled.value());
  PutLimits(talk->limits, news);
  news.set_joints(joints.data(), joints.size());
  *sent = {talk->last_command, talk->last_event, view, controlled, talk->limits, std::move(joints)};
  return message;
}

void PlayerNewsFeed::AfterTick(const region::Region& region, GamePort& port) {
  auto sent = sent_.begin();  // ascending by peer, as the clients are
  for (const auto& [peer, client] : port.clients()) {
    while (sent != sent_.end() && sent->first < peer) sent = sent_.erase(sent);
    if (sent == sent_.end() || sent->first != peer) sent = sent_.emplace_hint(sent, peer, std::nullopt);
    const std::optional<v1::RegionControl> message = NewsFor(region, client.player, sent->second);
    ++sent;
    if (!message) continue;
    metrics_.game_events.Increment(message->player_news().events_size());
    port.Send(peer, *message);
  }
  sent_.erase(sent, sent_.end());
}

}  // namespace tessera::worker
