#include "gateway/view_source.h"

#include <utility>

#include "gateway/viewer_encoder.h"
#include "gateway/viewer_format.h"

namespace tessera::gateway {
namespace {

constexpr std::chrono::milliseconds kKeepValues{200};
constexpr std::size_t kMaxCorrections = 64;  // that nobody has taken

}  // namespace

ViewSource::ViewSource(std::unique_ptr<client::Client> client, std::shared_ptr<const SceneBook> book,
                       const std::string& instance, std::uint64_t generation)
    : client_(std::move(client)), maker_(book) {
  feed_.generation = generation;
  feed_.book = std::move(book);
  feed_.welcome = EncodeWelcome(
      {.instance = instance, .own_body = client_->own_body(), .own_player = client_->player()}, client_->scene());
  feed_.detail = [this](BodyId body) { return client_ == nullptr ? "" : DetailMessage(*client_, body); };
  feed_.values = [this](const std::string& property, client::TimePoint now) -> const PropertyValues& {
    return Values(property, now);
  };
  EncodeMap();
  SayWorld();
}

const PropertyValues& ViewSource::Values(const std::string& property, client::TimePoint now) {
  static const PropertyValues kNone;
  const auto known = values_.find(property);
  if (known != values_.end() && now - known->second.at < kKeepValues) return known->second.values;
  if (client_ == nullptr) return known == values_.end() ? kNone : known->second.values;
  PropertyValues values = ValuesOf(*client_, property);
  // A property that viewers ask for and the scene does not declare is not kept.
  if (values.empty() && known == values_.end()) return kNone;
  Taken& taken = values_[property];
  taken = {.at = now, .values = std::move(values)};
  return taken.values;
}

void ViewSource::Poll(client::TimePoint now) {
  using Kind = client::ClientEvent::Kind;
  const bool was_joining = client_->state() == client::ClientState::kJoining;
  bool world_changed = false;
  for (const client::ClientEvent& event : client_->Poll(now)) {
    if (event.kind == Kind::kMapChanged) EncodeMap();
    if (event.kind == Kind::kRegionLost || event.kind == Kind::kRegionBack || event.kind == Kind::kMapChanged) {
      connected_changed_ = true;
    }
    // By itself it would dial on, where nobody is any more.
    if (event.kind == Kind::kGrantNeeded) needs_grant_ = true;
    if (event.kind == Kind::kRegionBack) needs_grant_ = false;
    if (event.kind == Kind::kPredictionCorrected && corrections_.size() < kMaxCorrections) {
      corrections_.push_back(event.detail);
    }
    if (event.kind == Kind::kWorldPropertyChanged) world_changed = true;
    if (event.kind == Kind::kRecordingEnded) recording_ended_ = event.detail;
    if (std::string met = MetMessage(event); !met.empty()) feed_.met.Add(std::move(met), kMaxMetKept);
  }
  if (world_changed) SayWorld();
  if (was_joining && client_->state() != client::ClientState::kJoining) connected_changed_ = true;
}

absl::Status ViewSource::WhyOver() const {
  if (client_->state() == client::ClientState::kEnded) return client_->reason();
  return needs_grant_ ? absl::UnavailableError("no region answers any more") : absl::OkStatus();
}

void ViewSource::Show(client::TimePoint now) { ShowRecorded(now, now, client_->clock().paused); }

void ViewSource::ShowRecorded(client::TimePoint now, client::TimePoint taken_at, bool paused) {
  feed_.picture = &maker_.Make(*client_, now, taken_at, paused);
}

void ViewSource::SetClient(std::unique_ptr<client::Client> client) {
  client_ = std::move(client);
  EncodeMap();
  SayWorld();
}

void ViewSource::SetHosts(const std::map<RegionId, std::string>& hosts) {
  if (hosts == hosts_) return;
  hosts_ = hosts;
  EncodeMap();
}

void ViewSource::EncodeMap() {
  feed_.map = gateway::EncodeMap(client_->map(), hosts_);
  ++feed_.map_number;
}

void ViewSource::SayWorld() {
  std::string world = WorldMessage(*client_);
  if (world == feed_.world) return;
  feed_.world = std::move(world);
  ++feed_.world_number;
}

HeardRegions ViewSource::Heard() const {
  HeardRegions heard;
  for (const client::RegionStats& region : client_->Stats().regions) {
    if (!region.connected) continue;
    HeardRegion& known = heard[region.region.value()];
    if (region.figures_received > 0) known.work = WorkOf(region.figures, region.figures_before);
  }
  return heard;
}

}  // namespace tessera::gateway
