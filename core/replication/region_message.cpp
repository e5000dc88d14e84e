#include "core/replication/region_message.h"

#include <utility>

#include "core/world/map_bytes.h"
#include "core/world/wire_reader.h"

namespace tessera::replication {
namespace {

Rect RectFrom(WireReader& in) {
  Rect rect;
  in.Message([&](WireReader& part) {
    if (part.field() == 1) rect.min_x = part.Real();
    if (part.field() == 2) rect.min_z = part.Real();
    if (part.field() == 3) rect.max_x = part.Real();
    if (part.field() == 4) rect.max_z = part.Real();
  });
  return rect;
}

Vec3d VectorFrom(WireReader& in) {
  Vec3d v;
  in.Message([&](WireReader& part) {
    if (part.field() == 1) v.x = part.Real();
    if (part.field() == 2) v.y = part.Real();
    if (part.field() == 3) v.z = part.Real();
  });
  return v;
}

tessera::Cell CellFrom(WireReader& in) {
  tessera::Cell cell{};
  in.Message([&](WireReader& part) {
    if (part.field() == 1) cell.area = RectFrom(part);
    if (part.field() == 2) cell.owner = RegionId(part.U32());
    if (part.field() == 3) cell.epoch = Epoch(part.U32());
    if (part.field() == 4) cell.from = RegionId(part.U32());
  });
  return cell;
}

MapRegion MapRegionFrom(WireReader& in) {
  MapRegion region{};
  in.Message([&](WireReader& part) {
    if (part.field() == 1) region.id = RegionId(part.U32());
    if (part.field() == 2) region.standby = RegionId(part.U32());
  });
  return region;
}

WorldTerms TermsFrom(WireReader& in) {
  WorldTerms terms;
  in.Message([&](WireReader& part) {
    if (part.field() == 1) terms.paused = part.Flag();
    if (part.field() == 2) terms.ticks_per_second = part.Real();
    if (part.field() == 3) terms.game = part.U32();
  });
  return terms;
}

AnnouncedMap MapFrom(WireReader& in) {
  AnnouncedMap map;
  in.Message([&](WireReader& part) {
    if (part.field() == 1) map.version = MapVersion(part.U64());
    if (part.field() == 2) map.bounds = RectFrom(part);
    if (part.field() == 3) map.cells.push_back(CellFrom(part));
    if (part.field() == 4) map.regions.push_back(MapRegionFrom(part));
    if (part.field() == 75) map.terms = TermsFrom(part);
  });
  return map;
}

AnnouncedEndpoint EndpointOf(WireReader& in) {
  AnnouncedEndpoint endpoint;
  in.Message([&](WireReader& part) {
    if (part.field() == 1) endpoint.region = part.U32();
    if (part.field() == 2) endpoint.host = part.Text();
    if (part.field() == 3) endpoint.game_port = part.U32();
    if (part.field() == 4) endpoint.incarnation = part.U64();
  });
  return endpoint;
}

ClockNews ClockFrom(WireReader& in) {
  ClockNews clock;
  in.Message([&](WireReader& part) {
    if (part.field() == 1) clock.paused = part.Flag();
    if (part.field() == 2) clock.ticks_per_second = part.Real();
    if (part.field() == 3) clock.tick = part.U64();
  });
  return clock;
}

Welcome WelcomeFrom(WireReader& in) {
  Welcome welcome;
  in.Message([&](WireReader& part) {
    if (part.field() == 1) welcome.region = part.U32();
    if (part.field() == 3) welcome.player = part.U32();
    if (part.field() == 7) welcome.started = part.Flag();
    if (part.field() == 8) welcome.news.map = MapFrom(part);
    if (part.field() == 9) welcome.news.endpoints.push_back(EndpointOf(part));
    if (part.field() == 75) welcome.clock = ClockFrom(part);
  });
  return welcome;
}

MapNews MapNewsFrom(WireReader& in) {
  MapNews news;
  in.Message([&](WireReader& part) {
    if (part.field() == 1) news.map = MapFrom(part);
    if (part.field() == 2) news.endpoints.push_back(EndpointOf(part));
  });
  return news;
}

RegionRefusal RefusalFrom(WireReader& in) {
  RegionRefusal refusal;
  in.Message([&](WireReader& part) {
    if (part.field() == 1) refusal.reason = static_cast<RefusalReason>(part.U32());
    if (part.field() == 2) refusal.detail = part.Text();
  });
  return refusal;
}

InputRefusal InputRefusalFrom(WireReader& in) {
  InputRefusal refusal;
  in.Message([&](WireReader& part) {
    if (part.field() == 1) refusal.body = part.U64();
    if (part.field() == 2) refusal.input_number = part.U32();
    if (part.field() == 3) refusal.detail = part.Text();
  });
  return refusal;
}

// The one text of a message that has nothing else.
std::string ReasonFrom(WireReader& in) {
  std::string reason;
  in.Message([&](WireReader& part) {
    if (part.field() == 1) reason = part.Text();
  });
  return reason;
}

Stopping StoppingFrom(WireReader& in) {
  Stopping stopping;
  in.Message([&](WireReader& part) {
    if (part.field() == 1) stopping.reason = part.Text();
    if (part.field() == 2) stopping.goes_on = part.Flag();
  });
  return stopping;
}

PairMeeting MeetingFrom(WireReader& in) {
  PairMeeting meeting;
  in.Message([&](WireReader& part) {
    if (part.field() == 1) meeting.point = VectorFrom(part);
    if (part.field() == 2) meeting.normal = VectorFrom(part);
    if (part.field() == 3) meeting.impulse = part.Real();
  });
  return meeting;
}

PairChange ChangeFrom(WireReader& in) {
  PairChange change;
  in.Message([&](WireReader& part) {
    if (part.field() == 1) change.body_a = part.U64();
    if (part.field() == 2) change.body_b = part.U64();
    if (part.field() == 3) change.trigger = part.Flag();
    if (part.field() == 4) change.begin = part.Flag();
    if (part.field() == 5) change.contact = MeetingFrom(part);
  });
  return change;
}

PairNews PairsFrom(WireReader& in) {
  PairNews news;
  in.Message([&](WireReader& part) {
    if (part.field() == 1) news.tick = part.U64();
    if (part.field() == 2) news.events.push_back(ChangeFrom(part));
    if (part.field() == 3) news.whole = part.Flag();
  });
  return news;
}

EventOfGame EventFrom(WireReader& in) {
  EventOfGame event;
  in.Message([&](WireReader& part) {
    if (part.field() == 1) event.name = part.Text();
    if (part.field() == 2) event.values.assign(part.Bytes().begin(), part.Bytes().end());
  });
  return event;
}

PlayerLimits LimitsFrom(WireReader& in) {
  PlayerLimits limits;
  limits.axes = {};  // a number that is 0 is left out
  in.Message([&](WireReader& part) {
    const auto real = [&part] { return static_cast<float>(part.Real()); };
    if (part.field() == 1) limits.force_n = real();
    if (part.field() == 2) limits.torque_nm = real();
    if (part.field() == 3) limits.speed_m_s = real();
    if (part.field() == 4) limits.axes.x = real();
    if (part.field() == 5) limits.axes.y = real();
    if (part.field() == 6) limits.axes.z = real();
  });
  return limits;
}

NewsOfPlayer NewsFrom(WireReader& in) {
  NewsOfPlayer news;
  in.Message([&](WireReader& part) {
    if (part.field() == 1) news.last_command = part.U32();
    if (part.field() == 2) news.last_event = part.U32();
    if (part.field() == 3) news.events.push_back(EventFrom(part));
    if (part.field() == 4) news.spectating = part.Flag();
    if (part.field() == 5) news.view.x = part.Real();
    if (part.field() == 6) news.view.y = part.Real();
    if (part.field() == 7) news.view.z = part.Real();
    if (part.field() == 8) news.epoch = part.U32();
    if (part.field() == 9) news.controlled_body = part.U64();
    if (part.field() == 10) news.limits = LimitsFrom(part);
    if (part.field() == 11) news.joints.assign(part.Bytes().begin(), part.Bytes().end());
  });
  return news;
}

NewsOfWorld WorldNewsFrom(WireReader& in) {
  NewsOfWorld news;
  in.Message([&](WireReader& part) {
    if (part.field() == 1) news.epoch = part.U32();
    if (part.field() == 2) news.tick = part.U64();
    if (part.field() == 3) news.properties.assign(part.Bytes().begin(), part.Bytes().end());
  });
  return news;
}

CommandRefusal CommandRefusalFrom(WireReader& in) {
  CommandRefusal refusal;
  in.Message([&](WireReader& part) {
    if (part.field() == 1) refusal.number = part.U32();
    if (part.field() == 2) refusal.detail = part.Text();
    if (part.field() == 3) refusal.for_good = part.Flag();
  });
  return refusal;
}

Started StartedFrom(WireReader& in) {
  Started started;
  in.Message([&](WireReader& part) {
    if (part.field() == 1) started.tick = part.U64();
  });
  return started;
}

std::optional<RegionMessage> MessageFrom(WireReader& in) {
  switch (in.field()) {
    case 1:
      return WelcomeFrom(in);
    case 2:
      return RefusalFrom(in);
    case 3:
      return StartedFrom(in);
    case 4:
      return MapNewsFrom(in);
    case 5:
      return InputRefusalFrom(in);
    case 6:
      return StoppingFrom(in);
    case 8:
      return PairsFrom(in);
    case 65:
      return NewsFrom(in);
    case 66:
      return EndOfSession{ReasonFrom(in)};
    case 67:
      return CommandRefusalFrom(in);
    case 75:
      return ClockFrom(in);
    case 76:
      return WorldNewsFrom(in);
    default:
      return std::nullopt;
  }
}

}  // namespace

std::string NameOf(RefusalReason reason) {
  switch (reason) {
    case RefusalReason::kUnspecified:
      return "UNSPECIFIED";
    case RefusalReason::kProtocol:
      return "PROTOCOL";
    case RefusalReason::kBadCredential:
      return "BAD_CREDENTIAL";
    case RefusalReason::kWrongInstance:
      return "WRONG_INSTANCE";
    case RefusalReason::kUnknownPlayer:
      return "UNKNOWN_PLAYER";
    case RefusalReason::kFull:
      return "FULL";
    case RefusalReason::kStopping:
      return "STOPPING";
    case RefusalReason::kWrongRegion:
      return "WRONG_REGION";
    case RefusalReason::kReplaced:
      return "REPLACED";
    case RefusalReason::kSessionEnded:
      return "SESSION_ENDED";
  }
  return "";
}

absl::StatusOr<PartitionMap> AnnouncedMap::Make() const {
  if (version == MapVersion()) return absl::InvalidArgumentError("version: must not be 0");
  if (absl::Status status = CheckTerms(terms); !status.ok()) return status;
  absl::StatusOr<PartitionMap> map = PartitionMap::Create(version, bounds, cells, regions);
  if (!map.ok()) return map.status();
  return map->With(terms);
}

absl::StatusOr<RegionMessage> DecodeRegionMessage(std::span<const std::uint8_t> bytes) {
  WireReader in(bytes);
  std::optional<RegionMessage> message;
  while (in.Next()) {
    if (std::optional<RegionMessage> read = MessageFrom(in)) message = std::move(read);
  }
  if (!in.ok()) return absl::InvalidArgumentError("region_control: malformed");
  if (!message) return absl::InvalidArgumentError("region_control: of an unknown kind");
  return *std::move(message);
}

}  // namespace tessera::replication
