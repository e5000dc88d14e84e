#include "gateway/viewer_message.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "core/world/limits.h"
#include "core/world/player_name.h"
#include "gateway/viewer_format.h"
#include "trust/ticket.h"

namespace tessera::gateway {
namespace {

using nlohmann::json;

constexpr std::size_t kMaxNameBytes = 64;  // for hosts
constexpr std::size_t kMaxTokenBytes = 256, kMaxKeyBytes = 64, kMaxTicketBytes = trust::kMaxTicketText;
constexpr std::uint64_t kMaxNumber = std::uint64_t{1} << 53;  // for an order, and for a tick: where JavaScript's end

// Reads fields of one object; after the first that is wrong all others are passed over.
class Fields {
 public:
  explicit Fields(const json& object) : object_(object) {}

  const absl::Status& status() const { return status_; }
  void Refuse(std::string_view name, std::string_view why) {
    if (status_.ok()) status_ = absl::InvalidArgumentError(absl::StrCat(Text(name), ": ", Text(why)));
  }

  const json* Find(const char* name) const {
    const auto found = object_.find(name);
    return found == object_.end() || found->is_null() ? nullptr : &*found;
  }
  std::optional<double> Real(const char* name, double least, double most) {
    const json* field = Find(name);
    if (field == nullptr) return std::nullopt;
    if (field->is_number() && field->get<double>() >= least && field->get<double>() <= most)
      return field->get<double>();
    Refuse(name, absl::StrCat("must be a number from ", least, " to ", most));
    return std::nullopt;
  }
  std::optional<std::uint64_t> Whole(const char* name, std::uint64_t least, std::uint64_t most) {
    const json* field = Find(name);
    if (field == nullptr) return std::nullopt;
    if (field->is_number_unsigned() && field->get<std::uint64_t>() >= least && field->get<std::uint64_t>() <= most) {
      return field->get<std::uint64_t>();
    }
    Refuse(name, absl::StrCat("must be a whole number from ", least, " to ", most));
    return std::nullopt;
  }
  std::optional<bool> Flag(const char* name) {
    const json* field = Find(name);
    if (field == nullptr) return std::nullopt;
    if (field->is_boolean()) return field->get<bool>();
    Refuse(name, "must be true or false");
    return std::nullopt;
  }
  std::string String(const char* name, std::size_t most) {
    const json* field = Find(name);
    if (field == nullptr) return "";
    if (field->is_string() && field->get_ref<const std::string&>().size() <= most) return field->get<std::string>();
    Refuse(name, absl::StrCat("must be a text of at most ", most, " bytes"));
    return "";
  }
  // Ids are texts, because numbers of JavaScript end at 2^53.
  BodyId Body(const char* name) {
    const json* field = Find(name);
    if (field == nullptr) return {};
    const std::optional<BodyId> id = BodyIdFrom(*field);
    if (!id) Refuse(name, "must be the id of a body, as a text");
    return id.value_or(BodyId());
  }
  // Numbers from -most to most.
  template <std::size_t kCount>
  std::optional<std::array<double, kCount>> Reals(const char* name, double most) {
    const json* field = Find(name);
    if (field == nullptr) return std::nullopt;
    std::array<double, kCount> reals{};
    const auto fits = [most](const json& part) { return part.is_number() && std::abs(part.get<double>()) <= most; };
    if (field->is_array() && field->size() == kCount && std::all_of(field->begin(), field->end(), fits)) {
      for (std::size_t i = 0; i < kCount; ++i) reals[i] = (*field)[i].get<double>();
      return reals;
    }
    Refuse(name, absl::StrCat("must be ", kCount, " numbers from ", -most, " to ", most));
    return std::nullopt;
  }
  // As Reals; 0 where there is none.
  Vec3f Vector(const char* name, double most) {
    const auto reals = Reals<3>(name, most).value_or(std::array<double, 3>{});
    return Vec3f(Vec3d{reals[0], reals[1], reals[2]});
  }
  void Need(const char* name) {
    if (Find(name) == nullptr) Refuse(name, "is missing");
  }

 private:
  static absl::string_view Text(std::string_view text) { return {text.data(), text.size()}; }

  const json& object_;
  absl::Status status_;
};

ViewerMessage ReadView(Fields& in) {
  SetView view;
  if (const auto rate = in.Whole("rate_hz", 1, kMaxFrameRate_hz)) view.rate_hz = static_cast<std::uint32_t>(*rate);
  if (const auto center = in.Reals<3>("center", kMaxCoordinate_m)) {
    view.center = Vec3d{(*center)[0], (*center)[1], (*center)[2]};
  }
  view.radius_m = in.Real("radius_m", 0, kMaxCoordinate_m).value_or(0);
  if (const auto most = in.Whole("kbytes_per_s", kMinBudget_kbytes_per_s, kMaxBudget_kbytes_per_s)) {
    view.bytes_per_s = static_cast<double>(*most) * 1000;
  }
  return view;
}

ViewerMessage ReadJoin(Fields& in) {
  JoinWorld join{in.String("name", kMaxPlayerNameBytes), in.String("ticket", kMaxTicketBytes)};
  if (!join.name.empty() && !join.ticket.empty()) in.Refuse("name", "the ticket says the name; leave it empty");
  if (const absl::Status status = CheckPlayerName(join.name); !status.ok()) {
    in.Refuse("name", std::string(status.message()));
  }
  return join;
}

ViewerMessage ReadSteer(Fields& in) {
  Steer steer;
  // Beyond what scenes allow; a float holds it.
  steer.steering.force_n = in.Vector("force", kMaxForce);
  steer.steering.torque_nm = in.Vector("torque", kMaxForce);
  const auto move = in.Reals<2>("move", kMaxForce).value_or(std::array<double, 2>{});
  steer.steering.move = {static_cast<float>(move[0]), static_cast<float>(move[1])};
  // Turned round often enough, a yaw is large; beyond this a float has steps that show.
  constexpr double kMaxAngle = 1e4;
  steer.steering.yaw_rad = static_cast<float>(in.Real("yaw", -kMaxAngle, kMaxAngle).value_or(0));
  steer.steering.pitch_rad = static_cast<float>(in.Real("pitch", -kMaxAngle, kMaxAngle).value_or(0));
  steer.steering.buttons = static_cast<std::uint32_t>(in.Whole("buttons", 0, 0xffffffff).value_or(0));
  return steer;
}

ViewerMessage ReadPlay(Fields& in) {
  PlayControl play;
  play.paused = in.Flag("paused");
  play.speed = in.Real("speed", kMinPlaySpeed, kMaxPlaySpeed);
  play.at_s = in.Real("at_s", 0, kMaxPlayTime_s);
  if (const auto step = in.Real("step", -kMaxPlaySteps, kMaxPlaySteps)) {
    play.step = static_cast<int>(*step);
    if (*play.step != *step) in.Refuse("step", "must be a whole number");
  }
  return play;
}

ViewerMessage ReadAuthorize(Fields& in) {
  Authorize authorize;
  in.Need("number");
  authorize.number = in.Whole("number", 0, kMaxNumber).value_or(0);
  authorize.token = in.String("token", kMaxTokenBytes);
  authorize.key = in.String("key", kMaxKeyBytes);
  if (authorize.token.empty() == authorize.key.empty()) in.Refuse("token", "give it, or a key");
  return authorize;
}

constexpr std::array<std::pair<std::string_view, OrderKind>, 11> kOrders{{{"scale", OrderKind::kScale},
                                                                          {"checkpoint", OrderKind::kCheckpoint},
                                                                          {"restore", OrderKind::kRestore},
                                                                          {"pause", OrderKind::kPause},
                                                                          {"resume", OrderKind::kResume},
                                                                          {"pace", OrderKind::kPace},
                                                                          {"step", OrderKind::kStep},
                                                                          {"drain", OrderKind::kDrain},
                                                                          {"set_property", OrderKind::kSetProperty},
                                                                          {"end_worker", OrderKind::kEndWorker},
                                                                          {"record", OrderKind::kRecord}}};

ViewerMessage ReadOrder(Fields& in) {
  Order order;
  in.Need("number");
  order.number = in.Whole("number", 0, kMaxNumber).value_or(0);
  const std::string name = in.String("order", kMaxNameBytes);
  const auto kind =
      std::find_if(kOrders.begin(), kOrders.end(), [&](const auto& known) { return known.first == name; });
  if (kind == kOrders.end()) {
    in.Refuse("order", "is none that a gateway knows");
    return order;
  }
  order.kind = kind->second;
  const auto need = [&](const char* field) { in.Need(field); };
  if (order.kind == OrderKind::kScale) need("regions");
  if (order.kind == OrderKind::kPace) need("ticks_per_second");
  if (order.kind == OrderKind::kStep) need("ticks");
  if (order.kind == OrderKind::kDrain) need("host");
  if (order.kind == OrderKind::kEndWorker) need("region");
  if (order.kind == OrderKind::kSetProperty) need("body"), need("name"), need("value");
  order.regions = static_cast<std::uint32_t>(in.Whole("regions", 1, kMaxRegions).value_or(0));
  order.region = static_cast<std::uint32_t>(in.Whole("region", 1, 0xffffffff).value_or(0));
  order.ticks = static_cast<std::uint32_t>(in.Whole("ticks", 1, kMaxStepTicks).value_or(0));
  order.tick = in.Whole("tick", 0, kMaxNumber).value_or(0);
  order.ticks_per_second = in.Real("ticks_per_second", 1, kMaxTickRateHz).value_or(0);
  order.host = in.String("host", kMaxNameBytes);
  order.property = in.String("name", kMaxNameLength);
  order.body = in.Body("body");
  if (const json* value = in.Find("value")) order.value = *value;
  order.on = in.Flag("on").value_or(false);
  return order;
}

}  // namespace

std::string_view NameOf(OrderKind kind) {
  const auto found =
      std::find_if(kOrders.begin(), kOrders.end(), [&](const auto& known) { return known.second == kind; });
  return found == kOrders.end() ? "order" : found->first;
}

std::optional<BodyId> BodyIdFrom(const json& text) {
  if (!text.is_string()) return std::nullopt;
  const std::string& digits = text.get_ref<const std::string&>();
  std::uint64_t id = 0;
  // SimpleAtoi passes over spaces and a plus.
  const bool is_decimal = std::all_of(digits.begin(), digits.end(), [](char c) { return c >= '0' && c <= '9'; });
  if (!is_decimal || !absl::SimpleAtoi(digits, &id)) return std::nullopt;
  return BodyId(id);
}

absl::StatusOr<ViewerMessage> ParseViewerMessage(std::string_view text) {
  const json message = json::parse(text.begin(), text.end(), nullptr, false);
  if (!message.is_object()) return absl::InvalidArgumentError("message: must be an object of JSON");
  Fields in(message);
  const std::string type = in.String("type", kMaxNameBytes);
  absl::StatusOr<ViewerMessage> read =
      absl::InvalidArgumentError("type: must be view, select, join, leave, steer, order, play, authorize or property");
  if (type == "view") read = ReadView(in);
  if (type == "select") read = Select{in.Body("body")};
  if (type == "join") read = ReadJoin(in);
  if (type == "leave") read = LeaveWorld{};
  if (type == "steer") read = ReadSteer(in);
  if (type == "order") read = ReadOrder(in);
  if (type == "play") read = ReadPlay(in);
  if (type == "authorize") read = ReadAuthorize(in);
  if (type == "property") read = ShowProperty{in.String("name", kMaxNameLength)};
  if (!in.status().ok()) return in.status();
  return read;
}

bool MessageBudget::Take(TimePoint now) {
  // A second's worth may come at once, after a second without any.
  const double elapsed_s = last_ ? std::chrono::duration<double>(now - *last_).count() : 1;
  tokens_ = std::min(tokens_ + elapsed_s * kViewerMessages_per_s, kViewerMessages_per_s);
  last_ = now;
  if (tokens_ < 1) return false;
  tokens_ -= 1;
  return true;
}

bool MessageBudget::Strike(TimePoint now) {
  while (!strikes_.empty() && now - strikes_.front() > std::chrono::minutes(1)) strikes_.pop_front();
  strikes_.push_back(now);
  return strikes_.size() >= kMaxBadMessages;
}

}  // namespace tessera::gateway
